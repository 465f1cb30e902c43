"""How often the intervals from outcomes alone hold the block that made them: random blocks, single-cosine trials.

    python -m tests.benchmarks.outcomes_coverage [--count 30] [--trials 200] [--scatter 2] [--wrong 0] [--seed 1]

Each block is drawn (slenderness 0.1 to 0.35 rad, frequency parameter 3 to 12 rad/s, restitution 0.95 to 1 times
Housner's); its trials are single cosines of omega / p from 1 to 8 and amplitudes from g tan(alpha) to 3 + omega / p
times that, what the table makes of them scattered by `--scatter` percent (one deviation), and `--wrong` percent of the
outcomes written down the wrong way round. The fit knows the nominal amplitudes, the frequencies and fell or not.
"""

from __future__ import annotations

import argparse
import math
import sys
import time

import numpy as np

from excitation import CosineWave
from twin.calibration.outcomes import Trial, fit_outcomes
from twin.rocking.block import Block
from twin.rocking.run import parameters
from twin.simulation import overturns

HIT = ("alpha", "p", "eta")


def draw_block(rng: np.random.Generator) -> tuple[Block, float]:
    """Return a random block and its restitution."""
    alpha, p = rng.uniform(0.1, 0.35), rng.uniform(3.0, 12.0)
    diagonal = 1.5 * 9.81 / p**2
    block = Block(diagonal * math.sin(alpha), diagonal * math.cos(alpha))
    return block, rng.uniform(0.95, 1.0) * block.housner_restitution


def draw_trials(
    rng: np.random.Generator, block: Block, eta: float, count: int, scatter: float = 0.0, wrong: float = 0.0
) -> list[Trial]:
    """Return trials of a block; `scatter` and `wrong` are shares of 1."""
    trials: list[Trial] = []
    body = parameters(block, eta)
    while len(trials) < count:
        w = rng.uniform(1.0, 8.0)
        amplitude = rng.uniform(1.0, 3.0 + w) * block.uplift_acceleration
        frequency = w * block.frequency_parameter / (2.0 * math.pi)
        made = amplitude * math.exp(scatter * rng.standard_normal())
        fell = overturns(body, CosineWave(made, frequency).pieces)
        if fell is not None:
            trials.append(Trial("cosine", amplitude, frequency, fell is not bool(rng.random() < wrong)))
    return trials


def main() -> int:
    """Print a line a block, and how many intervals held the truth."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=30)
    parser.add_argument("--trials", type=int, default=200)
    parser.add_argument("--scatter", type=float, default=2.0)
    parser.add_argument("--wrong", type=float, default=0.0)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    held = np.zeros(3, dtype=np.int64)
    errors: list[list[float]] = []
    widths: list[list[float]] = []
    faults, cpu, wall = 0, 0.0, 0.0
    for k in range(options.count):
        rng = np.random.default_rng([options.seed, k])
        block, eta = draw_block(rng)
        trials = draw_trials(rng, block, eta, options.trials, 0.01 * options.scatter, 0.01 * options.wrong)
        before = time.process_time(), time.perf_counter()
        fit = fit_outcomes(trials, seed=k)
        if k:  # the first may compile
            cpu, wall = cpu + time.process_time() - before[0], wall + time.perf_counter() - before[1]
        truth = (block.slenderness, block.frequency_parameter, eta)
        found = (fit.alpha, fit.p, fit.eta)
        inside = [one.low <= true <= one.high for one, true in zip(found, truth, strict=True)]
        held += inside
        errors.append([one.best / true - 1.0 for one, true in zip(found, truth, strict=True)])
        widths.append([(one.high - one.low) / true for one, true in zip(found, truth, strict=True)])
        faults += bool(fit.faults)
        said = "  ".join(
            f"{name} {true:.4f}: {one.best:.4f} ({one.low:.4f} to {one.high:.4f}){'' if hit else ' MISSED'}"
            for name, true, one, hit in zip(HIT, truth, found, inside, strict=True)
        )
        print(f"{k:3d}  {said}  draws {fit.mixing.draws:.0f}  {'; '.join(fit.faults)}", flush=True)
    timed = max(1, options.count - 1)
    print(f"held by the 95 % interval, of {options.count}: " + ", ".join(map("{} {}".format, HIT, held)))
    print("median |error| of the likeliest block: " + _percents(np.median(np.abs(errors), axis=0)))
    print("mean error: " + _percents(np.mean(errors, axis=0)))
    print("median width of the interval: " + _percents(np.median(widths, axis=0)))
    print(f"fits with a warning: {faults}; {cpu / timed:.1f} s of processor and {wall / timed:.1f} s a fit")
    return 0


def _percents(values: np.ndarray[tuple[int], np.dtype[np.float64]]) -> str:
    return ", ".join(f"{name} {100.0 * value:+.2f} %" for name, value in zip(HIT, values, strict=True))


if __name__ == "__main__":
    sys.exit(main())
