"""Where methods fail, as data: inputs and many-digit answers of twelve situations, each with its tolerance.

Block B6L, Housner's restitution and the nonlinear equation unless said. Values are good to every digit given: two
independent codes, or 45-digit arithmetic. N. Ceh, doctoral thesis, Rijeka 2018, for the block and the Newmark scheme.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum

import numpy as np

from excitation import ConstantPulse
from twin.chart.task import B6L, Task, sine
from twin.rocking.block import Block

P = B6L.frequency_parameter
LIMIT = B6L.uplift_acceleration
BULKY = Block(0.12, 0.27)
QUARTER = 0.2505181298324682
FIRST_RATE = 1.510969548533107
CRITICAL = 0.0951960321927143


class Quantity(Enum):
    """What is looked at in an answer."""

    UPLIFT = "uplift time [s]"
    IMPACT = "time of an impact [s]"
    RATE = "speed at an impact [rad/s]"
    REST = "time of rest [s]"
    OVERTURNING = "time at pi/2 [s]"
    PEAK = "peak rotation [rad]"
    ROTATION = "rotation at a time [rad]"
    STAYS = "never lifts"
    RETURNS = "comes back to the base"
    OVERTURNS = "overturns"


@dataclass(frozen=True, slots=True)
class Check:
    """One number a method has to get right, or refuse.

    Attributes
    ----------
    task : Task
    quantity : Quantity
    answer : float, bool or None
        None for OVERTURNS: undecided.
    tolerance : float
        Of the answer, in its unit; a method that states a larger error of its own is held to that.
    which : int
        Index of the impact (-1: the last).
    at : float
        Time of ROTATION, s.
    step : float or None
        Step for methods that have one, s; the check is theirs alone.
    """

    task: Task
    quantity: Quantity
    answer: float | bool | None
    tolerance: float = 0.0
    which: int = 0
    at: float = 0.0
    step: float | None = None


@dataclass(frozen=True, slots=True)
class Row:
    """One situation: its number in the table of failures, a short name, and what is checked."""

    number: int
    name: str
    checks: tuple[Check, ...]


def rows(*, quick: bool = False) -> tuple[Row, ...]:
    """Return the twelve situations; with `quick`, fewer restarts (3), a shorter run (10) and fewer cells (11)."""
    return (
        Row(1, "impacts faster than the step", _fast_impacts()),
        Row(2, "endless impacts, then rest", _endless()),
        Row(3, "restart on the contact", _restarts(40 if quick else 2000)),
        Row(4, "uplift at the threshold", _threshold()),
        Row(5, "grazing contact", _grazing()),
        Row(6, "break point of the pulse", _break_points()),
        Row(7, "near the unstable balance", _balance()),
        Row(8, "step of 2/p, of 1 µs", _newton()),
        Row(9, "order at an impact", _order()),
        Row(10, f"energy over {20 if quick else 1000} s, no loss", _energy(20.0 if quick else 1000.0)),
        Row(11, "undecidable outcome", _undecidable(quick=quick)),
        Row(12, "bulky block", _bulky()),
    )


def _fast_impacts() -> tuple[Check, ...]:
    task = Task("free, +0.002 rad/s", rate=0.002)
    times = (0.000346585297409356, 0.000668705727488220, 0.000968088226545074, 0.00124633782861527)
    first = tuple(Check(task, Quantity.IMPACT, t, 1e-13, which=n) for n, t in enumerate(times))
    return (*first, Check(task, Quantity.REST, 0.00490995674123549, 1e-13))


def _endless() -> tuple[Check, ...]:
    task = Task("free, 0.15 rad", rotation=0.15)
    known = {
        1: (QUARTER, FIRST_RATE),
        3: (0.9495878823179852, 1.305184906905899),
        10: (2.369828568764780, 0.781860372390040),
        50: (4.106185517566606, 0.041826914159381),
        100: (4.199172700842597, 0.001076128427011),
    }
    times = tuple(Check(task, Quantity.IMPACT, t, 1e-10, which=n - 1) for n, (t, _) in known.items())
    speeds = tuple(Check(task, Quantity.RATE, v, 1e-10, which=n - 1) for n, (_, v) in known.items())
    return (*times, *speeds, Check(task, Quantity.REST, 4.20162808742898, 1e-10))


def _restarts(count: int) -> tuple[Check, ...]:
    checks: list[Check] = []
    for speed in np.geomspace(1e-9, 0.21, count):
        # The linear flight; the nonlinear one takes less than twice as long.
        flight = 2.0 * math.atanh(speed / B6L.slenderness) / P
        task = Task(f"leaves at {speed:.6g} p", rate=speed * P, duration=2.0 * flight)
        checks.append(Check(task, Quantity.RETURNS, True))
    return tuple(checks)


def _threshold() -> tuple[Check, ...]:
    weak = Task("sine A = 1.0001, W = 3", sine(1.0001, 3.0))
    strong = Task("sine A = 3, W = 3", sine(3.0, 3.0))
    return (
        Check(Task("sine A = 1, W = 3", sine(1.0, 3.0)), Quantity.STAYS, True),
        Check(weak, Quantity.UPLIFT, 0.0711387583099853, 1e-12),
        Check(weak, Quantity.IMPACT, 0.0737238698832590, 1e-12),
        Check(strong, Quantity.UPLIFT, 0.0155304670444855, 1e-12),
        Check(strong, Quantity.IMPACT, 0.366383679370360, 1e-10),
        Check(strong, Quantity.RATE, 2.19928214486607, 1e-10),
        Check(strong, Quantity.OVERTURNING, 0.889657851683760, 1e-10),
    )


def _grazing() -> tuple[Check, ...]:
    touches = Task("sine A = 3.39331, W = 4", sine(3.39331, 4.0, 10.0), duration=0.5)
    misses = Task("sine A = 3.39332, W = 4", sine(3.39332, 4.0, 10.0), duration=0.5)
    return (
        Check(touches, Quantity.IMPACT, 0.311096168923972, 1e-9),
        Check(misses, Quantity.IMPACT, 0.314778571347720, 1e-9),
    )


def _constant(duration: float) -> Task:
    return Task(f"constant A = 2 for {duration:.12g} s", ConstantPulse(2.0 * LIMIT, duration))


def _break_points() -> tuple[Check, ...]:
    shorter, longer = _constant(CRITICAL * (1.0 - 1e-9)), _constant(CRITICAL * (1.0 + 1e-9))
    return (
        Check(shorter, Quantity.OVERTURNS, False),
        Check(shorter, Quantity.PEAK, 0.218658955722998, 1e-9),
        Check(longer, Quantity.OVERTURNS, True),
        Check(_constant(0.09519603228791035), Quantity.OVERTURNING, 3.2413689601, 1e-7),
    )


def _balance() -> tuple[Check, ...]:
    near, nearer = 0.21864707897935456, 0.21866894368725251
    beyond = Task("released above the corner", rotation=0.22085563533268138)
    alpha = B6L.slenderness
    return (
        *(
            Check(Task(f"released at {theta!r} rad", rotation=theta), Quantity.IMPACT, t, 2e-16 / (alpha - theta) / P)
            for theta, t in ((near, 1.35789784316246), (nearer, 2.62062902727305))
        ),
        Check(beyond, Quantity.OVERTURNS, True),
        Check(beyond, Quantity.OVERTURNING, 0.981539406054123, 1e-10),
    )


def _newton() -> tuple[Check, ...]:
    task = Task("free, 0.15 rad", rotation=0.15, duration=0.3)
    return tuple(Check(task, Quantity.IMPACT, QUARTER, 1e-10, step=step) for step in (2.0 / P, 1e-6))


def _order() -> tuple[Check, ...]:
    task = Task("free, 0.15 rad", rotation=0.15, duration=2.5)
    value = -0.0348222856551810
    stepped = (Check(task, Quantity.ROTATION, value, 1e-10, at=2.0, step=step) for step in (0.02, 0.01, 0.001))
    return (Check(task, Quantity.ROTATION, value, 1e-10, at=2.0), *stepped)


def _energy(duration: float) -> tuple[Check, ...]:
    task = Task("free, 0.15 rad, no loss", rotation=0.15, restitution=1.0, duration=duration)
    count = math.floor(0.5 * (duration / QUARTER + 1.0))
    return (
        Check(task, Quantity.OVERTURNS, False),
        Check(task, Quantity.RATE, FIRST_RATE, 1e-10, which=-1),
        Check(task, Quantity.IMPACT, (2 * count - 1) * QUARTER, 1e-9, which=-1),
    )


# A and W of cells of the 100 x 100 map of a sine lasting 10 s: one rounding of an input changes the outcome of the
# first; a step of 1 ms gets most of the others wrong.
UNDECIDABLE = ((3.7, 4.9), (4.3, 5.2), (6.4, 7.2), (4.9, 6.9), (6.2, 7.7))
FALLS = ((3.5, 5.7), (3.2, 4.5), (4.9, 7.2), (3.0, 3.0), (5.0, 2.0))
STANDS = ((2.8, 4.4), (4.6, 5.2), (6.3, 7.5), (1.5, 6.0), (4.0, 9.0))


def _undecidable(*, quick: bool) -> tuple[Check, ...]:
    most = 1 if quick else 5
    cells = ((UNDECIDABLE, None), (FALLS, True)) + (() if quick else ((STANDS, False),))
    return tuple(
        Check(
            Task(f"sine of 10 s, A = {a:g}, W = {w:g}", sine(a, w, 10.0 * w * P / (2.0 * math.pi))),
            Quantity.OVERTURNS,
            answer,
        )
        for known, answer in cells
        for a, w in known[:most]
    )


def _bulky() -> tuple[Check, ...]:
    known = ((0.0935, False), (0.0988032 * 0.9999, False), (0.0988032 * 1.0001, True))
    return tuple(
        Check(
            Task(f"0.12 m x 0.27 m, 8.72 m/s² for {duration:.6g} s", ConstantPulse(8.72, duration), block=BULKY),
            Quantity.OVERTURNS,
            falls,
        )
        for duration, falls in known
    )
