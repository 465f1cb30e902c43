"""Bias and coverage of `twin calibrate` over random free-rocking recordings of known truth.

    python -m tests.benchmarks.calibration_coverage --count 1000 [--jobs 2] [--seed 1] [--case N]

The truth comes from `twin.simulation.simulate`, flight by flight, not from the formulas that are fitted.
"""

from __future__ import annotations

import argparse
import json
import math
import time as clock
import warnings
from concurrent.futures import ProcessPoolExecutor
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from twin.calibration.calibrate import Calibration, calibrate
from twin.errors import InputError
from twin.rocking.block import Block
from twin.simulation import simulate

PARAMETERS = ("restitution", "k", "slenderness", "frequency parameter", "initial tilt", "zero", "each impact")


@dataclass(frozen=True, eq=False)
class Case:
    """One recording and its truth; SI, rad."""

    number: int
    block: Block
    mean: float
    ratios: np.ndarray
    scatter: float
    tilt: float
    offset: float
    noise: float
    rate: float
    held: float
    impacts: np.ndarray
    time: np.ndarray
    rotation: np.ndarray


def made(number: int, seed: int = 1) -> Case:
    """Return case `number`: the same one for ever."""
    rng = np.random.default_rng([seed, number])
    alpha = rng.uniform(0.1, 0.4)
    height = math.exp(rng.uniform(math.log(0.1), math.log(2.0)))
    block = Block(height * math.tan(alpha), height)
    mean = min(block.housner_restitution * rng.uniform(0.95, 1.03), 0.995)
    scatter = float(rng.choice([0.0, 0.003, 0.01]))
    tilt = rng.uniform(0.3, 0.9) * alpha * rng.choice([-1.0, 1.0])
    noise = math.exp(rng.uniform(math.log(1e-4), math.log(2e-3)))
    rate = math.exp(rng.uniform(math.log(100.0), math.log(1000.0)))
    wanted = int(rng.integers(3, 40))
    offset = rng.uniform(-5e-3, 5e-3)
    held = rng.uniform(0.05, 1.0) if rng.random() < 0.5 else 0.0
    ratios = np.clip(mean + scatter * rng.standard_normal(400), 0.0, 0.9999)

    first = simulate(block, initial_rotation=tilt, restitution=0.5)
    instants = [float(first.impact_times[0])]
    speed = abs(float(first.impact_rates[0]))
    side = -np.sign(tilt)
    pieces = [(0.0, instants[0], first)]
    for ratio in ratios:
        speed *= ratio
        flight = simulate(block, initial_angular_velocity=side * speed, restitution=0.5)
        lasting = float(flight.impact_times[0])
        pieces.append((instants[-1], lasting, flight))
        instants.append(instants[-1] + lasting)
        side = -side
        if lasting < 1e-3 or len(instants) > wanted + 1:
            break
    end = instants[min(wanted, len(instants) - 1)]
    # Half of the recordings go on behind the last flight made, at rest.
    rested = len(instants) <= wanted + 1 and rng.random() < 0.5
    begin = -held if held else (rng.uniform(0.0, 0.8) * instants[0] if rng.random() < 0.3 else 0.0)
    if rested:
        end = instants[-1] + rng.uniform(0.1, 1.0)
    else:
        end -= rng.uniform(0.0, 1.0) * (end - instants[min(wanted, len(instants) - 1) - 1])
    times = np.arange(begin, end, 1.0 / rate)
    rotation = np.where(times < 0.0, tilt, 0.0)
    for start, lasting, response in pieces:
        inside = (times >= start) & (times < start + lasting)
        rotation[inside] = response.rotation(times[inside] - start)
    rotation = rotation + offset + noise * rng.standard_normal(times.size)
    kept = rng.random(times.size) > rng.choice([0.0, 0.01])
    for _ in range(int(rng.integers(0, 4))):
        start = int(rng.integers(0, times.size))
        kept[start : start + int(rng.integers(1, 40))] = False
    return Case(
        number, block, mean, ratios, scatter, tilt, offset, noise, rate, held, np.array(instants),
        times[kept], rotation[kept],
    )  # fmt: skip


def judged(number: int, seed: int = 1) -> dict[str, object]:
    """Return what calibration says of a case: errors in its own deviations, and whether the intervals hold."""
    case = made(number, seed)
    row: dict[str, object] = {"case": number, "impacts": int(np.count_nonzero(case.impacts < case.time[-1]))}
    warnings.simplefilter("error")
    before = clock.process_time()
    try:
        found = calibrate(case.time, case.rotation)
    except InputError as refusal:
        return {**row, "refused": str(refusal)}
    except Exception as failure:  # noqa: BLE001 - a benchmark counts them
        return {**row, "failed": repr(failure)}
    row["seconds"] = clock.process_time() - before
    row["suspicions"] = [str(suspicion.kind) for suspicion in found.suspicions]
    row["scatter"] = case.scatter
    row["used"] = int(found.restitution.ratio.size)
    row["values"] = _values(case, found)
    return row


def _values(case: Case, found: Calibration) -> dict[str, list[list[float]]]:
    """Return per parameter rows of: error, stated deviation, 1 where the 95 % interval holds the truth."""
    s = math.sin(case.block.slenderness) ** 2
    k = (4.0 - 3.0 * s) * (1.0 - case.mean) / (3.0 * s * (1.0 + case.mean))
    truth = {
        "restitution": case.mean,
        "k": k,
        "slenderness": case.block.slenderness,
        "frequency parameter": case.block.frequency_parameter,
        "initial tilt": case.tilt,
        "zero": case.offset,
    }
    rows: dict[str, list[list[float]]] = {}
    for name, true in truth.items():
        if name not in found.estimates:
            rows[name] = []
            continue
        value = found.estimates[name]
        rows[name] = [[value.value - true, value.error, float(value.low <= true <= value.high), true]]
    each: list[list[float]] = []
    for time, ratio, error in zip(
        found.restitution.time, found.restitution.ratio, found.restitution.error, strict=True
    ):
        nearest = int(np.argmin(np.abs(case.impacts - time)))
        true = float(case.ratios[min(nearest, case.ratios.size - 1)])
        each.append([ratio - true, error, float(abs(ratio - true) <= 1.96 * error), true])
    rows["each impact"] = each
    return rows


def table(rows: list[dict[str, object]]) -> list[str]:
    """Return the lines of the table."""
    heads = ("cases", "bias/sigma", "rms/sigma", "rel. sigma", "95 % holds")
    lines = [f"{'parameter':20}" + "".join(f"{head:>12}" for head in heads)]
    fitted = [row for row in rows if "values" in row]
    for name in PARAMETERS:
        found = np.array([value for row in fitted for value in row["values"][name]])  # type: ignore[index]
        z = found[:, 0] / found[:, 1]
        lines.append(
            f"{name:20}{z.size:12d}{np.mean(z):12.3f}{np.sqrt(np.mean(z**2)):12.3f}"
            f"{np.median(found[:, 1] / np.abs(found[:, 3])):12.2e}{np.mean(found[:, 2]):12.3f}"
        )
    refused = [row for row in rows if "refused" in row]
    failed = [row for row in rows if "failed" in row]
    suspected = [row for row in fitted if row["suspicions"]]
    seconds = [float(row["seconds"]) for row in fitted]  # type: ignore[arg-type]
    lines.append(f"{len(fitted)} calibrated, {len(refused)} refused, {len(failed)} failed, of {len(rows)}")
    lines.append(
        f"{len(suspected)} suspected of something though nothing was there: {[r['case'] for r in suspected][:30]}"
    )
    lines.append(f"CPU: median {np.median(seconds):.3f} s, longest {np.max(seconds):.2f} s")
    reasons: dict[str, list[object]] = {}
    for row in refused + failed:
        reasons.setdefault(str(row.get("refused", row.get("failed")))[:110], []).append(row["case"])
    lines += [f"  {len(cases):4d} x {reason} {cases[:8]}" for reason, cases in sorted(reasons.items())]
    return lines


def main() -> None:
    """Run it."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=1000)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--out", type=Path, help="every case as a line of JSON")
    options = parser.parse_args()
    rows: list[dict[str, object]] = []
    with ExitStack() as stack:
        # Each case is written as it is done: a run that is broken off has told what it knew.
        file = None if options.out is None else stack.enter_context(options.out.open("w", encoding="utf-8"))
        run = map if options.jobs <= 1 else stack.enter_context(ProcessPoolExecutor(options.jobs)).map
        for row in run(judged, range(options.count), [options.seed] * options.count):
            rows.append(row)
            if file is not None:
                file.write(json.dumps(row) + "\n")
                file.flush()
    print("\n".join(table(rows)))


if __name__ == "__main__":
    main()
