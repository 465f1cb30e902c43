"""Does the plan's probability come true? Random scenes with hidden truths, run on the emulated table.

    python -m tests.benchmarks.plan_coverage --count 1000 [--seed 1] [--loop-percent 0] [--out PNG] [--csv FILE]

A scene is the same wherever it is run: `--first 500 --count 500 --csv b.csv` does the second half, and
`--join a.csv b.csv` makes the tables of several.

A scene: a block of random size, a sine, cosine, two sines or a constant pulse with its brake, 0.85 to 1.15 times the
amplitude that first overturns the block as it is stated, inside the table's capacity, and stated spreads of random
size. Its truth - slenderness, size, restitution, tilt, amplitude error - is drawn from the stated spreads by this file
alone, and lives on the plant of the emulated ST-III (set-points at 1 kHz, delay, position loop, largest force, top
speed), sub-stepped sample by sample, not in the futures' engine and not on their model of the table. Predicted is the
plan's probability with the emulated table's loop; observed is whether the block fell. With `--loop-percent` the plant's
own frequency differs from the known one by as much (one standard deviation), which no scene states.
"""

from __future__ import annotations

import argparse
import math
import time
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from devices.quanser_st3.capacity import CAPACITY
from devices.quanser_st3.parameters import St3Parameters
from devices.quanser_st3.plant import St3Plant
from twin.rehearsal import Rehearsal, rehearse
from twin.rocking.block import Block
from twin.rocking.response import Outcome
from twin.rocking.run import parameters
from twin.rocking.track import TrackedBlock
from twin.scene import parse_scene
from twin.simulation import overturns, simulate
from twin.uncertainty.population import Population
from twin.uncertainty.probability import Probability
from twin.uncertainty.shaking import shaking_of
from twin.uncertainty.table import LinearResponse

DT = 1e-3
KINDS = ("sine", "cosine", "two sines", "constant")
FUTURES = 4000
AFTER = 0.7
"""Time the plant goes on after what shakes the block, s."""
KNOWN = St3Parameters()


class Case(NamedTuple):
    """One scene: what was said and what happened."""

    kind: str
    predicted: float
    fell: bool


def main() -> None:
    """Run the study and print its tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--loop-percent", type=float, default=0.0)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--join", type=Path, nargs="+")
    parser.add_argument("--out", type=Path)
    parser.add_argument("--csv", type=Path)
    options = parser.parse_args()
    begin = time.process_time()
    cases: list[Case] = []
    for k in [] if options.join else range(options.first, options.first + options.count):
        cases.append(run_case(np.random.default_rng((options.seed, k)), options.loop_percent))
        if (k + 1) % 50 == 0:
            print(f"{len(cases)} of {options.count}, {time.process_time() - begin:.0f} s of processor time", flush=True)
    for path in options.join or []:
        rows = [line.split(",") for line in path.read_text(encoding="utf-8").splitlines()[1:]]
        cases += [Case(kind, float(said), fell == "1") for kind, said, fell in rows]
    predicted = np.array([case.predicted for case in cases])
    fell = np.array([case.fell for case in cases])
    report(cases, predicted, fell)
    if options.csv is not None:
        lines = ["kind,predicted,fell", *(f"{c.kind},{c.predicted:.6f},{int(c.fell)}" for c in cases)]
        options.csv.write_text("\n".join(lines) + "\n", encoding="utf-8")
    if options.out is not None:
        draw(predicted, fell, options.out)


def run_case(rng: np.random.Generator, loop_percent: float) -> Case:
    """Draw a scene, predict it, and let its truth happen."""
    while True:
        kind = str(rng.choice(KINDS))
        alpha, diagonal = rng.uniform(0.13, 0.32), rng.uniform(0.2, 0.6)
        block = Block(diagonal * math.sin(alpha), diagonal * math.cos(alpha))
        hertz = block.frequency_parameter * rng.uniform(1.0, 3.0) / math.tau
        spreads = {
            "restitution": rng.uniform(0.005, 0.03),
            "slenderness_percent": rng.uniform(0.2, 2.0),
            "size_percent": rng.uniform(0.2, 2.0),
            "initial_tilt_deg": rng.uniform(0.02, 0.3),
            "gain_percent": rng.uniform(0.5, 3.0),
        }
        edge = first_fall(block, kind, hertz)
        if edge is None:
            continue
        amplitude = edge * rng.uniform(0.85, 1.15)
        rehearsal = rehearse(
            parse_scene(text_of(block, kind, amplitude, hertz, spreads), name=kind, folder=Path()), CAPACITY
        )
        if rehearsal.clipped is None or not rehearsal.clipped.changed:
            break
    response = LinearResponse(KNOWN.loop(0.0).response, "the emulated table's loop")
    probability = Population.of(rehearsal).probability(shaking_of(rehearsal, response).variants)
    return Case(kind, probability.estimate, falls(rehearsal, spreads, rng, loop_percent))


def first_fall(block: Block, kind: str, hertz: float) -> float | None:
    """Return the least amplitude, m/s2, that overturns the stated block on a table that follows exactly."""
    body = parameters(block, block.housner_restitution)
    for factor in np.arange(1.02, 6.0, 0.02).tolist():
        scene = parse_scene(
            text_of(block, kind, factor * block.uplift_acceleration, hertz, {}), name=kind, folder=Path()
        )
        pulse = scene.pulse()
        if pulse is not None and overturns(body, pulse.pieces):
            return factor * block.uplift_acceleration
    return None


def text_of(block: Block, kind: str, amplitude: float, hertz: float, spreads: dict[str, float]) -> str:
    """Return the scene file."""
    shape = f'kind = "{kind}"\namplitude_m_s2 = {amplitude!r}\nfrequency_hz = {hertz!r}'
    if kind == "two sines":
        shape = f'kind = "sine"\namplitude_m_s2 = {amplitude!r}\nfrequency_hz = {hertz!r}\ncycles = 2.0'
    if kind == "constant":
        shape = f'kind = "constant"\nacceleration_m_s2 = {amplitude!r}\nduration_s = {0.35 / hertz!r}'
    lines = [f"{name} = {{ spread = {value!r} }}" for name, value in spreads.items() if name != "gain_percent"]
    return "\n".join(
        [
            "[block]",
            f"width_mm = {1e3 * block.width!r}",
            f"height_mm = {1e3 * block.height!r}",
            "[excitation]",
            shape,
            "[table]",
            'device = "quanser_st3"',
            "[uncertainty]",
            f"futures = {FUTURES}",
            *lines,
            "[uncertainty.table]",
            f"gain_percent = {{ spread = {spreads.get('gain_percent', 1.0)!r} }}",
        ]
    )


def falls(rehearsal: Rehearsal, spreads: dict[str, float], rng: np.random.Generator, loop_percent: float) -> bool:
    """Draw what is really there, let it run on the plant, and tell whether the block falls."""
    z = rng.standard_normal(6)
    block, motion = rehearsal.block, rehearsal.motion
    alpha = block.slenderness * (1.0 + 0.01 * spreads["slenderness_percent"] * z[0])
    diagonal = 2.0 * block.half_diagonal * (1.0 + 0.01 * spreads["size_percent"] * z[1])
    truth = Block(diagonal * math.sin(alpha), diagonal * math.cos(alpha))
    eta = min(max(rehearsal.restitution + spreads["restitution"] * z[2], 0.0), 1.0)
    gain = 1.0 + 0.01 * spreads["gain_percent"] * z[4]
    tracked = TrackedBlock(truth, eta, math.radians(spreads["initial_tilt_deg"] * z[3]))
    frequency = KNOWN.loop_frequency * (1.0 + 0.01 * loop_percent * z[5])
    start = motion.displacement(motion.pulse_start)
    plant = St3Plant(
        KNOWN.model_copy(update={"loop_frequency": frequency}), DT, rng, specimen=tracked.advance, position=start
    )
    times = motion.pulse_start + DT * np.arange(1, math.ceil((motion.shaking_end - motion.pulse_start) / DT) + 2)
    targets = start + gain * (motion.displacement(np.minimum(times, motion.shaking_end)) - start)
    # The set-points stay where what shakes the block is over.
    for target in [*targets.tolist(), *[float(targets[-1])] * round(AFTER / DT)]:
        plant.advance(target)
        if tracked.overturned:
            return True
    rest = simulate(
        truth,
        restitution=eta,
        initial_rotation=tracked.rotation,
        initial_angular_velocity=tracked.angular_velocity,
    )
    return rest.outcome is Outcome.OVERTURNED


def report(cases: list[Case], predicted: np.ndarray, fell: np.ndarray) -> None:
    """Print the calibration table and the scores."""
    print("\npredicted     scenes  fell  mean predicted  observed (95 % of the binomial)")
    for low, high, inside in bins(predicted):
        n, k = int(inside.sum()), int(fell[inside].sum())
        if n:
            p = Probability(n, k)
            print(
                f"{low:.1f} to {high:.1f}    {n:6d}  {k:4d}  {predicted[inside].mean():14.3f}  "
                f"{k / n:.3f} ({p.low:.3f} to {p.high:.3f})"
            )
    brier = float(np.mean((predicted - fell) ** 2))
    climate = float(fell.mean() * (1.0 - fell.mean()))
    own = float(np.mean(predicted * (1.0 - predicted)))
    spread = math.sqrt(float(np.sum(predicted * (1.0 - predicted) * (1.0 - 2.0 * predicted) ** 2))) / len(fell)
    said, error = float(predicted.sum()), math.sqrt(float(np.sum(predicted * (1.0 - predicted))))
    print(f"\nfell {int(fell.sum())} of {len(fell)}; predicted {said:.1f} +- {error:.1f}")
    print(f"Brier score {brier:.4f}; of the climate alone {climate:.4f}; skill {1.0 - brier / climate:.3f}")
    print(f"expected of a forecast that is right: {own:.4f} +- {spread:.4f}")
    for kind in KINDS:
        rows = np.array([case.kind == kind for case in cases])
        if rows.any():
            score = float(np.mean((predicted[rows] - fell[rows]) ** 2))
            print(
                f"{kind:<10} {int(rows.sum()):4d} scenes, fell {int(fell[rows].sum()):4d}, "
                f"predicted {predicted[rows].sum():7.1f}, Brier {score:.4f}"
            )


def bins(predicted: np.ndarray) -> list[tuple[float, float, np.ndarray]]:
    """Return the tenths of the predicted probability."""
    which = np.minimum((10.0 * predicted).astype(int), 9)
    return [(0.1 * k, 0.1 * (k + 1), which == k) for k in range(10)]


def draw(predicted: np.ndarray, fell: np.ndarray, path: Path) -> None:
    """Draw the calibration curve over the numbers of scenes."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure: Any = Figure(figsize=(6.4, 7.0), layout="constrained")
    FigureCanvasAgg(figure)
    upper, lower = figure.subplots(2, 1, height_ratios=[3, 1], sharex=True)
    upper.plot([0, 1], [0, 1], color="0.5", lw=1, ls="--", label="a forecast that is right")
    for k, (_, _, inside) in enumerate(bins(predicted)):
        if inside.any():
            p = Probability(int(inside.sum()), int(fell[inside].sum()))
            x, y = float(predicted[inside].mean()), float(fell[inside].mean())
            error = [[max(y - p.low, 0.0)], [max(p.high - y, 0.0)]]
            label = "scenes, 95 % of the binomial" if k == 0 else None
            upper.errorbar(x, y, yerr=error, fmt="o", color="black", ms=5, capsize=3, label=label)
    upper.set_ylabel("observed share that fell")
    upper.legend(loc="upper left")
    upper.grid(alpha=0.3)
    upper.set_title(f"Predicted probability of overturning, {len(fell)} scenes on the emulated table", fontsize=10)
    lower.hist(predicted, bins=np.linspace(0.0, 1.0, 11), color="0.6", edgecolor="black")
    lower.set_yscale("log")
    lower.set_ylabel("scenes")
    lower.set_xlabel("predicted probability")
    figure.savefig(path, dpi=130)


if __name__ == "__main__":
    main()
