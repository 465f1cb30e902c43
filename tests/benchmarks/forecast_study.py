"""How often the forecast and the advice are right: random runs of a simulated specimen that differs from the twin's.

    python -m tests.benchmarks.forecast_study [--runs 240] [--seed 1] [--record FILE.at2]

The specimen: restitution -5 %, slenderness +1 %, let go leaning by 0.2 degrees as the pulse begins; its rotation is
read with 1 mrad of noise in steps of 0.1 mrad, the base acceleration with the emulated table's noise and bias. The
table follows with the second-order lag of the emulated ST-III. No bus, no clock. Each run is made once with the plan;
stops are made from copies of specimen and table, at the instants asked about, and judged like the run itself.

The twin's stated spreads are a scene's defaults (restitution 0.01, slenderness 0.5 %, tilt 0.1 degrees), so that the
specimen is 4.6, 2 and 2 of them off; `--spreads 3` states what it is like. With `--drawn` the specimens are drawn from
the stated spreads instead: then the probabilities should come true as often as they say.

Excitations are drawn where it matters: 0.75 to 1.35 times the amplitude that first overturns the block the twin knows.
"""

from __future__ import annotations

import argparse
import copy
import itertools
import math
import sys
import time
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from devices.quanser_st3.parameters import St3Parameters
from excitation import ConstantPulse, CosineWave, DoublePulse, Motion, Pulse, Record, SineWave
from tests.closed_loop import ClosedLoop
from twin.forecast.forecast import Forecast, Forecaster, warm_up
from twin.forecast.futures import energy_margins
from twin.forecast.loop import TableLoop
from twin.forecast.observer import Observer, Uncertainty
from twin.forecast.ramp import RampDown, deceleration_for
from twin.rocking.block import Block
from twin.rocking.response import Outcome
from twin.rocking.run import parameters
from twin.rocking.track import TrackedBlock
from twin.simulation import overturns

DT = 1e-3
BLOCK = Block(0.06, 0.27)
LIMIT = BLOCK.uplift_acceleration
PARAMETERS = St3Parameters()
LOOP = TableLoop(frequency=PARAMETERS.loop_frequency, damping=PARAMETERS.loop_damping)
STOP = RampDown(0.5 * LIMIT, limit=0.25, steepest=9.81, reaction=2e-3)
KINDS = ("sine", "cosine", "constant", "double pulse", "record")
ALARM, LASTING = 0.9, 0.02
"""An alarm: this probability for so long, s; as the scene's trip has it unless told."""
AFTER = 2.0
SNAPSHOT = 10
"""Cycles between the instants at which a stop can be tried."""
ADVICES = ("continue", "stopping helps", "stopping would topple it", "too late", "undecided")


class Specimen:
    """The block on the table, and the table: what is really there."""

    def __init__(self, tilt: float, restitution: float, slenderness: float) -> None:
        diagonal = 2.0 * BLOCK.half_diagonal
        self.block = Block(diagonal * math.sin(slenderness), diagonal * math.cos(slenderness))
        self.eta = restitution
        self.tracked = TrackedBlock(self.block, self.eta, tilt)
        self.loop = ClosedLoop(LOOP.angular_frequency, LOOP.damping, DT, 0.0)

    def advance(self, target: float) -> None:
        before = self.loop.acceleration
        self.loop.advance(target)
        self.tracked.advance(DT, before, self.loop.acceleration)

    def falls_if_stopped(self, command: float, velocity: float, last: float, following: float) -> bool:
        """Ramp down: the set-points `last` and `following` are on their way, then the drive's own ramp."""
        there = copy.deepcopy(self)
        for target in (last, following):
            there.advance(target)
        d = deceleration_for(velocity, command, STOP.deceleration, 0.25, STOP.steepest)
        position = following
        while velocity != 0.0:
            slower = max(0.0, abs(velocity) - d * DT)
            velocity = math.copysign(slower, velocity) if slower > 0.0 else 0.0
            position += velocity * DT
            there.advance(position)
        for _ in range(40):
            there.advance(position)
        return there.will_fall()

    def will_fall(self) -> bool:
        """Whether it overturns if the base stays still."""
        if self.tracked.overturned or self.tracked.resting:
            return self.tracked.overturned
        theta, omega = self.tracked.rotation, self.tracked.angular_velocity
        side = math.copysign(1.0, theta if theta != 0.0 else omega)
        psi, v = self.block.slenderness - side * theta, side * omega / self.block.frequency_parameter
        return min(energy_margins(self.block.slenderness, self.eta, psi, v)) < 0.0


@dataclass
class Follower:
    """What one way of forecasting said in a run."""

    alarm: float | None = None
    advised: dict[str, float] = field(default_factory=dict)
    right: int = 0
    cycles: int = 0
    at: list[tuple[float, str, float]] = field(default_factory=list)
    shares: list[float] = field(default_factory=list)
    _since: dict[str, float] = field(default_factory=dict)

    def see(self, t: float, forecast: Forecast | None) -> None:
        if forecast is None:
            return
        if self._lasts("alarm", forecast.going_on.probability >= ALARM, t) and self.alarm is None:
            self.alarm = t
        for advice in ADVICES:
            if self._lasts(advice, forecast.advice == advice, t):
                self.advised.setdefault(advice, t)

    def _lasts(self, name: str, holds: bool, t: float) -> bool:
        if not holds:
            self._since.pop(name, None)
            return False
        return t - self._since.setdefault(name, t) >= LASTING - 1e-9


@dataclass
class Run:
    kind: str
    fell: float | None
    no_return: float | None
    followers: dict[str, Follower]


def synthetic_record(rng: np.random.Generator) -> Record:
    """Return 8 s of noise through a ground filter (Kanai 1957, Tajimi 1960) under an envelope, peak 1 m/s2."""
    dt, n = 0.01, 800
    w, zeta = math.tau * rng.uniform(1.0, 2.5), rng.uniform(0.2, 0.5)
    white = rng.standard_normal(n)
    x = v = 0.0
    a = np.zeros(n)
    for k in range(n):
        push = -white[k] - 2.0 * zeta * w * v - w * w * x
        v += push * dt
        x += v * dt
        a[k] = -2.0 * zeta * w * v - w * w * x
    t = np.arange(n) * dt
    a *= np.minimum(1.0, t / 1.5) * np.minimum(1.0, np.exp(-(t - 4.5) / 1.2))
    a -= np.linspace(a[0], a[-1], n)
    return Record(a / np.max(np.abs(a)), dt, "synthetic")


def draw(kind: str, rng: np.random.Generator, record: Record | None) -> Pulse:
    """Return an excitation of random shape, near the amplitude that first overturns the twin's block."""
    hertz = BLOCK.frequency_parameter * rng.uniform(0.8, 3.0) / math.tau
    pulse: Pulse
    if kind == "sine":
        pulse = SineWave(LIMIT, hertz, float(rng.choice([1, 1, 2, 4])))
    elif kind == "cosine":
        pulse = CosineWave(LIMIT, hertz)
    elif kind == "constant":
        pulse = ConstantPulse(LIMIT, rng.uniform(0.05, 0.25))
    elif kind == "double pulse":
        pulse = DoublePulse(0.1, rng.uniform(0.012, 0.04), pulse_acceleration=20.0)
    elif record is not None and rng.random() < 0.5:
        start = int(rng.integers(0, max(1, len(record.samples) - 900)))
        part = record.samples[start : start + 900] * np.hanning(900) ** 0.25
        pulse = Record(part / np.max(np.abs(part)) * LIMIT, record.time_step)
    else:
        pulse = synthetic_record(rng).scaled(LIMIT)
    body = parameters(BLOCK, BLOCK.housner_restitution)
    factor = 1.0
    while factor < 12.0 and not overturns(body, course(pulse.scaled(factor)).pieces):
        factor *= 1.02
    return pulse.scaled(factor * rng.uniform(0.75, 1.35))


def course(pulse: Pulse) -> Pulse:
    """Return the pulse with the brake it needs."""
    return Motion(pulse, STOP.deceleration, brake=STOP.deceleration).shaking


def set_up(rng: np.random.Generator, drawn: Uncertainty | None) -> Specimen:
    """Return the specimen of the study, or one drawn from stated spreads."""
    eta, alpha = BLOCK.housner_restitution, BLOCK.slenderness
    if drawn is None:
        return Specimen(math.copysign(math.radians(0.2), rng.random() - 0.5), 0.95 * eta, 1.01 * alpha)
    z = rng.standard_normal(3)
    restitution = min(1.0, eta + drawn.restitution * z[1])
    return Specimen(drawn.initial_tilt * z[0], restitution, alpha * (1.0 + drawn.slenderness * z[2]))


def perform(
    kind: str, rng: np.random.Generator, record: Record | None, unsure: Uncertainty, *, drawn: bool = False
) -> Run:
    """Make one run, and try stopping wherever something was said."""
    pulse = course(draw(kind, rng, record))
    specimen = set_up(rng, unsure if drawn else None)
    ways = {"with": Observer(BLOCK, uncertainty=unsure), "without": Observer(BLOCK, uncertainty=unsure)}
    forecasters = {way: Forecaster(BLOCK, pulse.pieces, STOP, loop=LOOP) for way in ways}
    followers = {way: Follower() for way in ways}
    cycles = math.ceil((pulse.duration + AFTER) / DT)
    targets = pulse.displacement(np.arange(cycles + 2) * DT).tolist()
    speeds = pulse.velocity(np.arange(cycles + 2) * DT).tolist()
    snapshots: dict[int, Specimen] = {}
    said: dict[str, list[tuple[int, Outcome]]] = {way: [] for way in ways}
    asked = sorted(int(k) for k in rng.integers(1, max(2, math.ceil(pulse.duration / DT)), 3))
    chosen: dict[str, list[tuple[int, str]]] = {way: [] for way in ways}
    fell: float | None = None
    for k in range(cycles):
        t = k * DT
        if k:
            specimen.advance(targets[k])
        acceleration = specimen.loop.acceleration + PARAMETERS.accelerometer_bias
        acceleration += PARAMETERS.accelerometer_noise * rng.standard_normal()
        reading = round((specimen.tracked.rotation + 1e-3 * rng.standard_normal()) / 1e-4) * 1e-4
        if specimen.tracked.overturned:
            fell = t
            break
        if k % SNAPSHOT == 0 or k in asked:
            snapshots[k] = copy.deepcopy(specimen)
        for way, observer in ways.items():
            observer.update(t, acceleration, reading if way == "with" else math.nan)
            forecast = forecasters[way].update(observer)
            followers[way].see(t, forecast)
            if forecast is not None and t < pulse.duration:
                said[way].append((k, forecast.going_on.outcome))
                if k in asked:
                    chosen[way].append((k, forecast.advice))
                    followers[way].shares.append(forecast.going_on.probability)
        if t > pulse.duration + 0.05 and specimen.tracked.resting:
            break
    stops: dict[int, bool] = {}

    def stopped(k: int) -> bool:
        k = k if k in snapshots else SNAPSHOT * round(k / SNAPSHOT)
        k = k if k in snapshots else max(j for j in snapshots if j <= k)
        if k not in stops:
            stops[k] = snapshots[k].falls_if_stopped(targets[k + 1], speeds[k + 1], targets[k + 1], targets[k + 2])
        return stops[k]

    no_return: float | None = None
    if fell is not None:
        for k in sorted((j for j in snapshots if j % SNAPSHOT == 0), reverse=True):
            if not stopped(k):
                no_return = k * DT
                break
    for way, follower in followers.items():
        truth = fell is not None
        follower.cycles = len(said[way])
        follower.right = sum((outcome is Outcome.OVERTURNED) == truth for _, outcome in said[way])
        for advice, t in follower.advised.items():
            follower.at.append((t, advice, float(stopped(round(t / DT)))))
        for k, advice in chosen[way]:
            follower.at.append((-1.0, advice, float(stopped(k))))
    return Run(kind, fell, no_return, followers)


def report(runs: list[Run]) -> None:
    """Print both tables."""
    header = (
        "| excitation | forecast | runs | fell | alarms right | false alarms | missed | before pi/2, s | "
        "before the last stop that saves, s | instants right |"
    )
    print(header + "\n|" + "---|" * 10)
    for kind in (*KINDS, "all"):
        chosen = [run for run in runs if kind in ("all", run.kind)]
        for way in ("with", "without"):
            print(_row(kind, way, chosen))
    print("\n| advice, first given | forecast | times | only going on falls | only stopping falls | both | neither |")
    print("|" + "---|" * 7)
    for first in (True, False):
        if not first:
            print(
                "\n| advice, at random instants | forecast | times | only going on | only stopping | both | neither |"
            )
            print("|" + "---|" * 7)
        for advice in ADVICES:
            for way in ("with", "without"):
                cases = [
                    (run.fell is not None, bool(stop))
                    for run in runs
                    for t, said, stop in run.followers[way].at
                    if said == advice and (t >= 0.0) == first
                ]
                counts = [cases.count(case) for case in ((True, False), (False, True), (True, True), (False, False))]
                print(f"| {advice} | {way} | {len(cases)} | " + " | ".join(map(str, counts)) + " |")


def reliability(runs: list[Run]) -> None:
    """Print how often the block fell where the forecast gave it each probability."""
    print("\n| probability of falling, at random instants | with observer: times, fell | without: times, fell |")
    print("|---|---|---|")
    for low, high in itertools.pairwise((0.0, 0.05, 0.25, 0.75, 0.95, 1.01)):
        cells: list[str] = []
        for way in ("with", "without"):
            fell = [run.fell is not None for run in runs for share in run.followers[way].shares if low <= share < high]
            cells.append(f"{len(fell)}, {100.0 * np.mean(fell):.0f} %" if fell else "0")
        print(f"| {low:.2f} to {min(high, 1.0):.2f} | {cells[0]} | {cells[1]} |")


def _row(kind: str, way: str, runs: list[Run]) -> str:
    fell = [run for run in runs if run.fell is not None]
    alarms = [run for run in runs if run.followers[way].alarm is not None]
    right = [run for run in alarms if run.fell is not None]
    early = [run.fell - run.followers[way].alarm for run in right]
    # Without a stop that saves there is nothing to be early for.
    saved = [run.no_return - run.followers[way].alarm for run in right if run.no_return is not None]
    instants = sum(run.followers[way].right for run in runs) / max(1, sum(run.followers[way].cycles for run in runs))
    return (
        f"| {kind} | {way} observer | {len(runs)} | {len(fell)} | {len(right)} | {len(alarms) - len(right)} | "
        f"{len(fell) - len(right)} | {_spread(early)} | {_spread(saved)} | {100 * instants:.1f} % |"
    )


def _spread(values: list[float]) -> str:
    if not values:
        return "-"
    low, middle = np.percentile(values, [10, 50])
    return f"{middle:.2f} ({low:.2f})"


def main() -> None:
    """Make the runs and print the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=240)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--record", type=Path)
    parser.add_argument("--spreads", type=float, default=1.0, help="factor on the stated spreads (default: 1)")
    parser.add_argument("--drawn", action="store_true", help="draw each specimen from the stated spreads instead")
    options = parser.parse_args()
    record = None if options.record is None else Record.from_at2(options.record.read_text(encoding="utf-8"))
    stated, k = Uncertainty(), options.spreads
    unsure = Uncertainty(
        restitution=k * stated.restitution, slenderness=k * stated.slenderness, initial_tilt=k * stated.initial_tilt
    )
    warm_up()
    begun = time.perf_counter()
    runs: list[Run] = []
    for n in range(options.runs):
        rng = np.random.default_rng([options.seed, n])
        runs.append(perform(KINDS[n % len(KINDS)], rng, record, unsure, drawn=options.drawn))
        if n % 20 == 19:
            print(f"{n + 1} runs, {time.perf_counter() - begun:.0f} s", file=sys.stderr)
    report(runs)
    reliability(runs)
    took = time.perf_counter() - begun
    print(f"\n{len(runs)} runs, seed {options.seed}, {took:.0f} s. Leads: median (10th percentile).")


if __name__ == "__main__":
    main()
