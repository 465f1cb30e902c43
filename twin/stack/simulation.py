"""`simulate_stack`: a stack, a base motion, and what happens."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from twin.rocking.compiled import FloatArray
from twin.rocking.march import HALF_TURN
from twin.rocking.run import STILL_BASE, local_tolerance
from twin.stack.configuration import Configuration
from twin.stack.response import Ending, History, Impact, LostContact, Overturning, StackResponse
from twin.stack.run import Run, initial_state
from twin.stack.solver import book
from twin.stack.solver.chain import ANGULAR_MOMENTUM, ENDS, FALLS, PULLS, UNILATERAL, P, chain_of
from twin.stack.solver.march import (
    ALL_DOWN,
    CAME_TO_REST,
    CONTACT_LOST,
    NO_ANSWER,
    REACHED,
    SEVERAL_ANSWERS,
)
from twin.stack.stack import Stack

if TYPE_CHECKING:
    from excitation import Pulse

IMPACT_RULES = {"unilateral": UNILATERAL, "angular-momentum": ANGULAR_MOMENTUM}
PULLING_PIVOTS = {"ends": ENDS, "falls": FALLS, "pulls": PULLS}
ENDINGS = {
    CAME_TO_REST: Ending.AT_REST,
    REACHED: Ending.DURATION,
    ALL_DOWN: Ending.ALL_DOWN,
    CONTACT_LOST: Ending.CONTACT_LOST,
    NO_ANSWER: Ending.NO_CANDIDATE,
    SEVERAL_ANSWERS: Ending.SEVERAL_CANDIDATES,
}
LEAST_STICKING_RATE, LARGEST_STICKING_RATE = 1e-11, 1e-6


def simulate_stack(
    stack: Stack,
    pulse: Pulse | None = None,
    *,
    initial_rotation: float | Sequence[float] = 0.0,
    initial_angular_velocity: float | Sequence[float] = 0.0,
    duration: float | None = None,
    tolerance: float = 1e-10,
    impact_rule: str = "unilateral",
    pulling_pivot: str = "ends",
) -> StackResponse:
    """Return how `stack` answers `pulse`: nonlinear equations, every event at its exact time.

    Parameters
    ----------
    stack : Stack
    pulse : Pulse, optional
        Base motion; None for free rocking.
    initial_rotation, initial_angular_velocity : float or sequence of float
        Absolute, one for each block from the base up or one for all; rad (magnitude below pi/2) and rad/s.
    duration : float, optional
        Length of the run, s. None: until all rest or lie, or the run ends otherwise.
    tolerance : float
        Absolute error of the rotations along the run, rad, above 0, where the motion itself does not magnify errors.
    impact_rule : str
        "unilateral": every closed interface may stick or open about either corner, and the one candidate whose rates
        open and whose impulses push is taken. "angular-momentum": an interface that strikes passes to its other corner
        (or sticks, where that would not open), every other stays as it is (N. Ceh, Rijeka 2018): where an upper block
        lands on a resting one, that one stays at rest.
    pulling_pivot : str
        What happens where a pivot would have to pull. "ends": the run ends there. "falls": where everything above
        that pivot, or above a lower one, is past its balance and turning outwards, it counts as overturned then, and
        the rest goes on; otherwise the run ends. "pulls": it pulls, as in the theory of one block.

    Raises
    ------
    ValueError
        Where an argument is not finite or outside its range.

    Examples
    --------
    >>> from twin.rocking.block import Block
    >>> response = simulate_stack(Stack([Block(0.06, 0.27), Block(0.06, 0.27)]), initial_rotation=[0.02, 0.05])
    >>> response.mode, response.ending.value
    ('none', 'at rest')

    References
    ----------
    N. Ceh, doctoral thesis, Rijeka 2018, chapters 6 to 8.
    """
    rotations = _for_each(stack, initial_rotation, "initial rotation")
    rates = _for_each(stack, initial_angular_velocity, "initial angular velocity")
    if not bool(np.all(np.abs(rotations) < HALF_TURN)):
        raise ValueError(f"initial rotation is {_largest(rotations):g} rad; it must lie inside -pi/2 to pi/2")
    if duration is not None and not 0.0 < duration < math.inf:
        raise ValueError(f"duration is {duration:g} s; it must be above 0 and finite")
    if not 0.0 < tolerance < math.inf:
        raise ValueError(f"tolerance is {tolerance:g} rad; it must be above 0 and finite")
    rule = chosen("impact rule", impact_rule, IMPACT_RULES)
    lost = chosen("pulling pivot", pulling_pivot, PULLING_PIVOTS)
    chain = chain_of(stack, local_tolerance(tolerance), sticking_rate(tolerance), rule, lost)
    run = Run(chain, initial_state(chain, rotations, rates))
    start: Configuration = tuple(int(side) for side in run.state.side)
    end = math.inf if duration is None else duration
    pieces = STILL_BASE[:0] if pulse is None else np.array(pulse.pieces)
    run.advance(pieces, end)
    still = not len(pieces) or bool(pieces[-1, 1] <= end)
    return _response(stack, pulse, run, start, impact_rule, pulling_pivot, still=still)


def chosen(what: str, name: str, known: dict[str, float]) -> float:
    """Return what `name` stands for; raises `ValueError` in one sentence."""
    if name not in known:
        raise ValueError(f"there is no {what} {name!r}; there are {', '.join(known)}")
    return known[name]


def sticking_rate(tolerance: float) -> float:
    """Return the closing rate, units of p, below which an interface sticks without its candidates being looked at."""
    return min(max(0.1 * tolerance, LEAST_STICKING_RATE), LARGEST_STICKING_RATE)


def _for_each(stack: Stack, given: float | Sequence[float], name: str) -> FloatArray:
    values = np.asarray(given, dtype=np.float64)
    if values.ndim == 0:
        values = np.full(len(stack), float(values))
    if values.shape != (len(stack),):
        raise ValueError(f"{name} has the shape {values.shape}; the stack has {len(stack)} blocks")
    if not bool(np.all(np.isfinite(values))):
        raise ValueError(f"{name} must be finite")
    return values


def _largest(values: FloatArray) -> float:
    return float(values[np.argmax(np.abs(values))])


def _response(
    stack: Stack, pulse: Pulse | None, run: Run, start: Configuration, rule: str, pulling: str, *, still: bool
) -> StackResponse:
    ending = ENDINGS.get(run.code, Ending.UNFINISHED)
    if ending is Ending.UNFINISHED and run.safe:
        ending = Ending.SETTLED
    if ending is Ending.DURATION and run.resting and still:
        ending = Ending.AT_REST
    impacts, overturnings, configurations = _story(run.events, len(stack), start)
    for_ever = ending in (Ending.AT_REST, Ending.ALL_DOWN)
    rest = run.rest_time if ending is Ending.AT_REST and run.lifted and run.standing else None
    return StackResponse(
        stack=stack,
        pulse=pulse,
        impact_rule=rule,
        pulling_pivot=pulling,
        ending=ending,
        overturnings=overturnings,
        lost_contact=_lost(run) if ending is Ending.CONTACT_LOST else None,
        impacts=impacts,
        configurations=configurations,
        rest_time=rest,
        end_time=math.inf if for_ever else run.time,
        peak_rotations=run.state.peak.copy(),
        lifted=run.lifted,
        _history=_history(run, still_from=run.time if for_ever else math.inf),
    )


def _history(run: Run, *, still_from: float) -> History:
    steps = run.steps
    n = len(run.state.gap)
    coefficients = steps[:, book.STEP_HEAD :].reshape(len(steps), n, book.COEFFICIENTS)
    return History(steps[:, 0], steps[:, 1], coefficients, float(run.chain.scales[P]), still_from)


def _story(
    events: FloatArray, n: int, start: Configuration
) -> tuple[tuple[Impact, ...], tuple[Overturning, ...], tuple[tuple[float, Configuration], ...]]:
    """Return impacts, overturnings and the history of configurations from the rows of events."""
    impacts: list[Impact] = []
    overturnings: list[Overturning] = []
    configurations = [(0.0, start)]
    standing = n
    for row in events:
        time, kind, which = float(row[0]), float(row[1]), int(row[2])
        sides, before, after, rotations = row[book.EVENT_HEAD :].reshape(4, n).copy()
        last, now = configurations[-1][1], tuple(int(side) for side in sides)
        if kind == book.IMPACT or (kind in (book.NO_CANDIDATE, book.SEVERAL) and which >= 0):
            impacts.append(Impact(time, which, before, after, rotations, last, now, float(row[3]), int(row[4])))
        if kind == book.OVERTURNED or (kind == book.LOST and row[4] == book.LEFT):
            blocks = tuple(range(which, standing))
            overturnings.append(Overturning(time, blocks, rotations[which:standing], kind == book.LOST))
            standing = which
        if now != last:
            configurations.append((time, now))
    return tuple(impacts), tuple(overturnings), tuple(configurations)


def _lost(run: Run) -> LostContact:
    row = run.events[-1]
    gone = run.falling_from
    return LostContact(float(row[0]), int(row[2]), bool(row[4] < 0), None if gone < 0 else gone)
