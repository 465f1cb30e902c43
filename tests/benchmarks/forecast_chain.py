"""How often the forecast and the advice are right, through the real chain: bus, emulated table, the live loop.

    python -m tests.benchmarks.forecast_chain --runs 200 --seed 1 [--jobs 2] --out table.csv [--record FILE.at2]

Every scene is performed twice, by the code of `twin run --fast` (`chain_run`): with the observer, and without the
rotation sensor, so that the forecast starts from the free prediction. The specimen differs from the twin's block:
restitution -5 %, slenderness +1 %, leaning by 0.2 degrees as the pulse begins, 1 mrad of noise. The spreads the twin
states are a scene's defaults, of which it is 4.6, 2 and 2 off; `--spreads 3` states what it is like. Scenes are drawn
near the amplitude that first fells the twin's block (`chain_scenes`).

Stops are really made (`chain_run`): where an alarm or an advice is first given, at three random instants of the
shaking, and in runs that fall every 20 ms of its last 2.5 s, for the last stop that saves. Rows are written as they
come; runs that are in the file are not made again. `--repeat` makes one stop of each run again from the beginning.
"""

from __future__ import annotations

import argparse
import csv
import json
import os
import sys
import tempfile
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np

from excitation import Record
from tests.benchmarks.chain_run import Performed, performed, repeated, short
from tests.benchmarks.chain_scenes import KINDS, draw
from tests.benchmarks.chain_tables import report
from twin.forecast.forecast import warm_up

GRID, LOOKED_BACK = 0.02, 2.5
"""Distance of the stops tried for the last that saves, and how far before the fall they begin, s."""
RANDOM = 3
COLUMNS: tuple[str, ...] = (
    "seed", "spreads", "run", "kind", "excitation", "draws", "forecast", "pulse_s", "shaking_end_s", "fell_s",
    "no_return_s", "alarm_s", "alarm_in_pulse_s", "alarm_stop", "right", "instants", "first", "random", "repeated",
    "cycles", "cpu_s",
)  # fmt: skip
RECORD = Path("../shared/data/kobe1995_nishi_akashi_090.at2")


def study(
    number: int, seed: int, record: Path | None, *, repeat: bool = False, spreads: float = 1.0
) -> list[dict[str, Any]]:
    """Return the two rows of one run: with the observer, and without."""
    begun = _processor_time()
    measured = None if record is None else Record.from_at2(record.read_text(encoding="utf-8"))
    rng = np.random.default_rng([seed, number, 2])
    with tempfile.TemporaryDirectory() as folder:
        drawn = draw(KINDS[number % len(KINDS)], seed, number, Path(folder), measured, spreads)
        rehearsal = short(drawn.scene)
        motion, hz = rehearsal.motion, drawn.scene.twin.cycle_hz
        start, end = (round(t * hz) for t in (motion.pulse_start, motion.shaking_end))
        at = sorted(int(k) for k in rng.choice(np.arange(start + 1, end), RANDOM, replace=False))
        observed = performed(rehearsal, observed=True, asked=at)
        fell = observed.fell
        # Once the table stands there is nothing to stop.
        grid = [] if fell is None else _grid(min(fell, motion.shaking_end), fell, motion.pulse_start, hz)
        free = performed(rehearsal, observed=False, asked={*at, *grid})
        if fell != free.fell:
            raise RuntimeError(f"run {number} fell at {fell} s and, made again, at {free.fell} s")
        k = at[number % RANDOM]
        again = [k, observed.stops.get(k), repeated(rehearsal, k)] if repeat and k in observed.stops else None
    no_return = max((k / hz for k in grid if free.stops.get(k) is False), default=None)
    shared = {
        "seed": seed,
        "spreads": spreads,
        "run": number,
        "kind": drawn.kind,
        "excitation": drawn.scene.excitation.model_dump_json(exclude_none=True),
        "draws": drawn.draws,
        "pulse_s": motion.pulse_start,
        "shaking_end_s": motion.shaking_end,
        "fell_s": fell,
        "no_return_s": no_return,
        "repeated": json.dumps(again),
        "cpu_s": round(_processor_time() - begun, 3),
    }
    return [shared | _row(done, way, at, hz) for way, done in (("with", observed), ("without", free))]


def _processor_time() -> float:
    """Return the processor time of this process and of the copies it made, s."""
    return sum(os.times()[:4])


def _grid(last: float, fell: float, pulse: float, hz: float) -> list[int]:
    """Return cycles `GRID` apart, backwards from the last one in which there is something to stop."""
    first = max(pulse - GRID, fell - LOOKED_BACK, 0.0)
    times = np.arange(last - 1.0 / hz, first - 1e-9, -GRID)
    return sorted({round(float(t) * hz) for t in times})


def _row(done: Performed, way: str, at: list[int], hz: float) -> dict[str, Any]:
    def stop(t: float | None) -> bool | None:
        return None if t is None else done.stops.get(round(t * hz))

    first = [[advice, t, stop(t)] for advice, t in done.advised.items()]
    random = [[*done.said[k], done.stops[k]] for k in at if k in done.said]
    alarm = done.alarm_in_pulse
    said = None if alarm is None else [done.said[round(alarm * hz)][0], stop(alarm)]
    return {
        "forecast": way,
        "alarm_s": done.alarm,
        "alarm_in_pulse_s": alarm,
        "alarm_stop": json.dumps(said),
        "right": done.right,
        "instants": done.instants,
        "first": json.dumps(first),
        "random": json.dumps(random),
        "cycles": done.cycles,
    }


def rows_of(path: Path) -> list[dict[str, str]]:
    """Return the rows of a study's file; none where there is no file."""
    if not path.exists():
        return []
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def _asked_for(options: argparse.Namespace) -> list[dict[str, str]]:
    asked = options.seed, options.spreads
    return [row for row in rows_of(options.out) if (int(row["seed"]), float(row["spreads"])) == asked]


def _studies(numbers: list[int], options: argparse.Namespace) -> Iterator[list[dict[str, Any]]]:
    one = partial(study, seed=options.seed, record=options.record, repeat=options.repeat, spreads=options.spreads)
    if options.jobs == 1:
        yield from map(one, numbers)
        return
    with ProcessPoolExecutor(options.jobs, mp_context=get_context("spawn")) as pool:
        yield from pool.map(one, numbers)


def main() -> None:
    """Make the runs that are missing, and print the tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--out", type=Path, required=True, metavar="TABLE.csv")
    parser.add_argument("--record", type=Path, default=RECORD if RECORD.exists() else None, metavar="FILE.at2")
    parser.add_argument("--repeat", action="store_true", help="make one stop of each run again from the beginning")
    parser.add_argument("--spreads", type=float, default=1.0, help="factor on the spreads the twin states (default: 1)")
    options = parser.parse_args()
    warm_up()
    known = {int(row["run"]) for row in _asked_for(options)}
    missing = [n for n in range(options.runs) if n not in known]
    fresh = not options.out.exists()
    with options.out.open("a", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, COLUMNS)
        if fresh:
            writer.writeheader()
        for n, rows in enumerate(_studies(missing, options), 1):
            writer.writerows(rows)
            file.flush()
            if n % 20 == 0:
                print(f"{n} of {len(missing)} runs", file=sys.stderr)
    report(_asked_for(options))


if __name__ == "__main__":
    main()
