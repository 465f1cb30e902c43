"""`simulate`: a block, a base motion, and what happens."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

from twin.rocking.block import Block
from twin.rocking.compiled import FloatArray
from twin.rocking.march import HALF_TURN, IMPACT, OVERTURNED, REST, STUCK, UPLIFT
from twin.rocking.response import Outcome, Response
from twin.rocking.run import MOST_STEPS, STILL_BASE, Run, initial_state, local_tolerance, parameters

if TYPE_CHECKING:
    from excitation import Pulse

ERROR_DEVIATIONS = 8.0
ONE_ROUNDING = 2.0**-52


def simulate(
    block: Block,
    pulse: Pulse | None = None,
    *,
    restitution: float | None = None,
    initial_rotation: float = 0.0,
    initial_angular_velocity: float = 0.0,
    duration: float | None = None,
    tolerance: float = 1e-10,
) -> Response:
    """Return how `block` answers `pulse`: nonlinear equation, every impact at its exact time.

    Parameters
    ----------
    block : Block
    pulse : Pulse, optional
        Base motion; None for free rocking.
    restitution : float, optional
        Ratio of angular velocities after and before an impact, 0 to 1. None: Housner's.
    initial_rotation, initial_angular_velocity : float
        rad (|rotation| below pi/2) and rad/s, signed: positive leans towards +x.
    duration : float, optional
        Length of the run, s: a longer pulse ends there. None: until the block rests or lies.
    tolerance : float
        Absolute error of the rotation along the run, rad, above 0; see `Response.rotation_error`.

    Returns
    -------
    Response
        The outcome is for ever: once the pulse is over, the state decides, whatever the duration.

    Raises
    ------
    ValueError
        Where an argument is not finite or outside its range.

    Examples
    --------
    >>> simulate(Block(0.06, 0.27), initial_rotation=0.15).outcome
    <Outcome.ROCKED: 'rocked'>

    References
    ----------
    G. W. Housner, Bull. Seism. Soc. Am. 53(2), 1963; N. Ceh, doctoral thesis, Rijeka 2018, chapter 3.
    """
    eta = block.housner_restitution if restitution is None else restitution
    _check(eta, initial_rotation, initial_angular_velocity, duration, tolerance)
    pieces = STILL_BASE[:0] if pulse is None else pulse.pieces
    shaking = float(pieces[-1, 1]) if len(pieces) else 0.0
    end = math.inf if duration is None else duration

    body = parameters(block, eta, local_tolerance(tolerance))
    run = Run(body, initial_state(body, initial_rotation, initial_angular_velocity))
    run.advance(pieces, end)
    if run.code == STUCK:
        raise ValueError(
            f"the run needs more than {MOST_STEPS} steps: it got to {run.time:.6g} s of {min(end, shaking):.6g} s; "
            "give a shorter duration"
        )
    overturns, doubt = run.overturns_on_still_base()
    if doubt or run.doubtful:
        overturns = _settled_overturning(body, pieces, end, initial_rotation, initial_angular_velocity, overturns)
    if not run.fallen and end > shaking:
        run.advance_free(end)

    return _response(block, eta, run, overturns, ERROR_DEVIATIONS * run.worst_error, min(end, max(run.time, shaking)))


def overturns(
    body: FloatArray, pieces: FloatArray, *, rotation: float = 0.0, angular_velocity: float = 0.0, end: float = math.inf
) -> bool | None:
    """Return whether the block overturns, None where one rounding of an input decides; no history is kept.

    `body` is from `parameters`; `end` cuts the pieces, s; the initial rotation (rad) and rate (rad/s) are signed.
    """
    verdict, doubt = _first_verdict(body, pieces, end, rotation, angular_velocity)
    return _settled_overturning(body, pieces, end, rotation, angular_velocity, verdict) if doubt else verdict


def _first_verdict(body: FloatArray, pieces: FloatArray, end: float, rotation: float, rate: float) -> tuple[bool, bool]:
    """Return whether the block overturns, and whether that has to be looked at again."""
    run = Run(body, initial_state(body, rotation, rate), record=False)
    run.advance(pieces, end)
    verdict, doubt = run.overturns_on_still_base()
    return verdict, doubt or run.doubtful


def _settled_overturning(
    body: FloatArray, pieces: FloatArray, end: float, rotation: float, rate: float, verdict: bool
) -> bool | None:
    """Return the verdict if it survives one rounding of every input and another step length; None if it does not."""
    for changed, shaken, theta, omega in _neighbours(body, pieces, rotation, rate):
        again, _ = _first_verdict(changed, shaken, end, theta, omega)
        if again is not verdict:
            return None
    return verdict


def _neighbours(
    body: FloatArray, pieces: FloatArray, rotation: float, rate: float
) -> Iterator[tuple[FloatArray, FloatArray, float, float]]:
    for stride in (0.71, 0.53, 0.37):
        changed = body.copy()
        changed[5] = 1e-16
        changed[6] = stride
        yield changed, pieces, rotation, rate
    for sign in (1.0, -1.0):
        factor = 1.0 + sign * ONE_ROUNDING
        for index in (0, 1, 3):  # alpha, p, eta
            changed = body.copy()
            changed[index] = min(changed[index] * factor, 1.0) if index == 3 else changed[index] * factor
            yield changed, pieces, rotation, rate
        louder = pieces.copy()
        louder[:, 2:5] *= factor
        slower = pieces.copy()
        slower[:, :2] *= factor
        slower[:, 3] /= factor
        slower[:, 5] /= factor
        yield body, louder, rotation, rate
        yield body, slower, rotation, rate
        if rotation != 0.0 or rate != 0.0:
            yield body, pieces, rotation * factor, rate * factor


def _response(block: Block, eta: float, run: Run, overturning: bool | None, error: float, known: float) -> Response:
    events = run.events
    codes = events[:, 2]
    impacts = events[codes == IMPACT]
    lifts = events[codes == UPLIFT]
    rests = events[codes == REST]
    falls = events[codes == OVERTURNED]
    started = len(run.steps) > 0 and run.steps[0, 2] != 0.0
    uplift = 0.0 if started else float(lifts[0, 0]) if len(lifts) else None

    if overturning is None:
        outcome = Outcome.UNDECIDED
    elif overturning:
        outcome = Outcome.OVERTURNED
    else:
        outcome = Outcome.STAYED if uplift is None else Outcome.ROCKED

    resting = run.resting and uplift is not None
    lying = run.fallen
    side = float(run.state[1]) if lying else 0.0
    return Response(
        block=block,
        restitution=eta,
        outcome=outcome,
        uplift_time=uplift,
        impact_times=impacts[:, 0].copy(),
        impact_rates=impacts[:, 1].copy(),
        rest_time=float(rests[-1, 0]) if resting and len(rests) else None,
        overturning_time=float(falls[0, 0]) if len(falls) and outcome is Outcome.OVERTURNED else None,
        peak_rotation=float(run.state[5]),
        rotation_error=error,
        end_time=math.inf if run.resting or lying else known,
        _steps=run.steps,
        _final=(run.time if lying or run.resting else math.inf, side),
    )


def _check(eta: float, rotation: float, rate: float, duration: float | None, tolerance: float) -> None:
    if not 0.0 <= eta <= 1.0:
        raise ValueError(f"restitution is {eta:g}; it is a ratio of angular velocities, from 0 to 1")
    if not abs(rotation) < HALF_TURN:
        raise ValueError(f"initial rotation is {rotation:g} rad; it must lie inside -pi/2 to pi/2")
    if not math.isfinite(rate):
        raise ValueError(f"initial angular velocity is {rate:g} rad/s; it must be finite")
    if duration is not None and not 0.0 < duration < math.inf:
        raise ValueError(f"duration is {duration:g} s; it must be above 0 and finite")
    if not 0.0 < tolerance < math.inf:
        raise ValueError(f"tolerance is {tolerance:g} rad; it must be above 0 and finite")
