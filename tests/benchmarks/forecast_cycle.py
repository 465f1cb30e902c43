"""What state, observer, forecast and 64 futures cost in a cycle, and how right the futures are.

    python -m tests.benchmarks.forecast_cycle [--cycles 3000] [--states 4000]

CPU time of the thread (`time.thread_time_ns`) for one cycle of the twin: the free prediction, the observer with a noisy
reading, and the forecast of both branches, over a run of its kind on the emulated ST-III's loop. Beside it the futures'
engine against the exact solver from random states at random instants of random pulses of the kind: a wrong outcome is
counted as near where 1e-4 rad of the starting rotation, or 1e-4 of the base's motion, changes the exact outcome too.
"""

from __future__ import annotations

import argparse
import gc
import math
import os
import time

import numpy as np

from excitation import ConstantPulse, CosineWave, DoublePulse, Motion, Pulse, Record, SineWave
from tests.benchmarks.forecast_study import BLOCK, DT, LIMIT, LOOP, STOP, synthetic_record
from tests.closed_loop import ClosedLoop
from tests.twin.forecast.exact import Start, exact_fate, fast_fates, near_a_boundary
from twin.forecast.forecast import Forecaster, warm_up
from twin.forecast.observer import Observer
from twin.rocking.track import TrackedBlock

P, ALPHA, ETA = BLOCK.frequency_parameter, BLOCK.slenderness, BLOCK.housner_restitution
NOISE = np.convolve(np.random.default_rng(9).standard_normal(4096), np.hanning(9), "same")
LONG = Record(1.25 * LIMIT * NOISE / np.max(np.abs(NOISE)), 0.01, "41 s")
RUNS: dict[str, Pulse] = {
    "single sine": SineWave(1.35 * LIMIT, 4.0),
    "sine, 12 cycles (3 s)": SineWave(1.1 * LIMIT, 4.0, 12.0),
    "single cosine": CosineWave(1.6 * LIMIT, 4.0),
    "constant": ConstantPulse(1.2 * LIMIT, 0.15),
    "double pulse": DoublePulse(0.4, 0.02),
    "record, 8 s": synthetic_record(np.random.default_rng(2)).scaled(1.6 * LIMIT),
    "record, 41 s": LONG,
}


def cost(pulse: Pulse, cycles: int) -> tuple[np.ndarray, float]:
    """Return the CPU time of each cycle, us, and the greatest age of a forecast, s."""
    motion = Motion(pulse, STOP.deceleration, brake=STOP.deceleration, settle=0.1).shaking
    rng = np.random.default_rng(1)
    specimen, free, observer = TrackedBlock(BLOCK, 0.95 * ETA, 0.0035), TrackedBlock(BLOCK), Observer(BLOCK)
    forecaster = Forecaster(BLOCK, motion.pieces, STOP, loop=LOOP)
    table = ClosedLoop(LOOP.angular_frequency, LOOP.damping, DT, 0.0)
    spent = np.zeros(cycles)
    oldest = before = measured = 0.0
    for k in range(cycles):
        t = k * DT
        if k:
            table.advance(float(motion.displacement(t)))
            specimen.advance(DT, before, table.acceleration)
        if specimen.overturned:
            return spent[:k], oldest
        before, earlier = table.acceleration, measured
        measured = before + 0.05 * rng.standard_normal()
        reading = 1e-4 * round((specimen.rotation + 1e-3 * rng.standard_normal()) / 1e-4)
        begun = time.thread_time_ns()
        if k:
            free.advance(DT, earlier, measured)
        observer.update(t, measured, reading)
        forecast = forecaster.update(observer)
        spent[k] = 1e-3 * (time.thread_time_ns() - begun)
        if forecast is not None:
            oldest = max(oldest, forecast.age)
    return spent, oldest


def random_pulse(name: str, rng: np.random.Generator) -> Pulse:
    """Return a pulse of the kind with random numbers."""
    amplitude, hertz = LIMIT * rng.uniform(0.9, 4.0), P * rng.uniform(0.6, 6.0) / math.tau
    if name == "single sine":
        return SineWave(amplitude, hertz)
    if name.startswith("sine"):
        return SineWave(0.7 * amplitude, hertz, float(rng.integers(2, 13)))
    if name == "single cosine":
        return CosineWave(amplitude, hertz)
    if name == "constant":
        return ConstantPulse(amplitude, rng.uniform(0.02, 1.0) / P)
    if name == "double pulse":
        return DoublePulse(rng.uniform(0.1, 0.9), rng.uniform(0.01, 0.05))
    record = synthetic_record(rng)
    return Record(record.samples[: 300 if "8" in name else 800] * 0.7 * amplitude, 0.01)


def random_start(rng: np.random.Generator) -> Start:
    """Return a random block in a random state."""
    alpha, eta = ALPHA * (1.0 + 0.01 * rng.standard_normal()), min(1.0, ETA * (1.0 + 0.05 * rng.standard_normal()))
    if rng.random() < 0.3:
        return Start(0.0, 0.0, 0.0, alpha, eta)
    phi, rate = 1.2 * alpha * rng.random() ** 2, 1.8 * math.sin(0.5 * alpha) * rng.uniform(-1.0, 1.0)
    return Start(float(rng.choice([-1.0, 1.0])), phi, rate, alpha, eta)


def accuracy(name: str, states: int) -> tuple[int, int, int, np.ndarray]:
    """Return how many states were looked at, wrong outcomes, those of them not near a boundary, and errors of times."""
    rng = np.random.default_rng([3, len(name)])
    wrong = far = looked = 0
    late: list[float] = []
    while looked < states:
        pulse = random_pulse(name, rng)
        t = pulse.duration * rng.random() * rng.integers(0, 2)
        starts = [random_start(rng) for _ in range(16)]
        looked += len(starts)
        for start, fast in zip(starts, fast_fates(BLOCK, starts, t, pulse.pieces), strict=True):
            exact = exact_fate(BLOCK, start, t, pulse.pieces)
            falls = exact.margin < 0.0
            if (fast.margin < 0.0) != falls:
                wrong += 1
                far += not near_a_boundary(BLOCK, start, t, pulse.pieces)
            elif falls:
                late.append(abs(fast.fall - exact.fall))
    return looked, wrong, far, np.array(late or [0.0])


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cycles", type=int, default=3000)
    parser.add_argument("--repeats", type=int, default=4)
    parser.add_argument("--states", type=int, default=4000)
    options = parser.parse_args()
    warm_up()
    gc.collect()
    gc.freeze()
    print(
        "| run | cycles | p50, us | p99 | p99.9 | most | oldest, ms | states | wrong | of them not near | time off, s |"
    )
    print("|" + "---|" * 11)
    for name, pulse in RUNS.items():
        runs = [cost(pulse, options.cycles) for _ in range(options.repeats)]
        spent = np.concatenate([run[0] for run in runs])
        low, high, top = np.percentile(spent, [50.0, 99.0, 99.9])
        looked, wrong, far, late = accuracy(name, options.states)
        print(
            f"| {name} | {len(spent)} | {low:.0f} | {high:.0f} | {top:.0f} | {spent.max():.0f} | "
            f"{1e3 * max(run[1] for run in runs):.0f} | {looked} | {wrong} | {far} | "
            f"{np.median(late):.0e}, 99 %: {np.percentile(late, 99.0):.0e} |",
            flush=True,
        )
    load = f"{os.getloadavg()[0]:.1f}" if hasattr(os, "getloadavg") else "unknown"
    print(f"\nLoad of the machine: {load} on {os.cpu_count()} processors.")


if __name__ == "__main__":
    main()
