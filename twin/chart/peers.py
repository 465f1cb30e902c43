"""Other people's solvers, driven as their manuals show: an event at the contact, flip, go on.

heyoka (F. Biscani & D. Izzo, MNRAS 504, 2021): adaptive Taylor series, compiled. SciPy (P. Virtanen et al., Nature
Methods 17, 2020): `solve_ivp` with DOP853 and its own event rule. CVODE of SUNDIALS (A. C. Hindmarsh et al., ACM TOMS
31, 2005) through scikit-sundae: Adams. Uplift and the verdict on a still base are ours for all of them; impacts slower
than 1e-6 p end the run, as none of them can sum an endless sequence.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from importlib.util import find_spec
from typing import Protocol

import numpy as np

from twin.chart.flyers import CONTACT, FALLEN, CvodeFlyer, HeyokaFlyer, PeerFailed, ScipyFlyer
from twin.chart.solvers import TOLERANCE, Solver
from twin.chart.task import HALF_TURN, Answer, Task
from twin.rocking.compiled import FloatArray
from twin.rocking.restitution import restitution_ratio
from twin.rocking.series import T0, T1, base_acceleration
from twin.rocking.uplift import first_uplift
from twin.rocking.verdict import barrier_margins

TIGHTEST = {"heyoka": 1e-15, "SciPy events": 1e-13, "CVODE": 1e-13}
"""Tolerance where no setting is given."""
STATED = 1e-8
"""What an answer at the tightest is held to, rad: a peer states the tolerance of a step, not of the run."""
MOST_IMPACTS = 5000
LONGEST = 200.0
REST_RATE = 1e-6
STILL = np.array([0.0, math.inf, 0.0, 0.0, 0.0, 0.0, 0.0])

Dense = Callable[[FloatArray], FloatArray]


class Flyer(Protocol):
    """A peer's integrator: one flight on one side."""

    def fly(
        self, t: float, phi: float, v: float, side: float, piece: FloatArray, end: float
    ) -> tuple[float, float, float, int, Dense]:
        """Go from t to `end`, or to the contact (code 1) or pi/2 (code 2); return t, phi, v, code and the motion."""
        ...


def peer_solvers() -> tuple[list[Solver], list[str]]:
    """Return the peers that are installed, and the names of those that are not."""
    known: list[tuple[str, str, Callable[[Task, float], Flyer]]] = [
        ("heyoka", "heyoka", HeyokaFlyer),
        ("SciPy events", "scipy", ScipyFlyer),
        ("CVODE", "sksundae", CvodeFlyer),
    ]
    solvers: list[Solver] = []
    absent: list[str] = []
    for name, module, make in known:
        if find_spec(module) is None:
            absent.append(name)
            continue
        settings = (1e-4, 1e-6, 1e-8, 1e-10, 1e-12) if name != "heyoka" else (1e-4, 1e-6, 1e-9, 1e-12, 1e-15)
        run = partial(_peer_run, make, TIGHTEST[name])
        solvers.append(Solver(name, run, TOLERANCE, settings, settings[1::3], peer=True))
    return solvers, absent


def _peer_run(make: Callable[[Task, float], Flyer], tightest: float, task: Task, setting: float | None) -> Answer:
    try:
        return follow(make(task, tightest if setting is None else setting), task)
    except (RuntimeError, ArithmeticError) as error:
        raise PeerFailed(str(error)) from None


def follow(flyer: Flyer, task: Task) -> Answer:
    """Follow the block with a peer's flights; raises `PeerFailed`."""
    block, p = task.block, task.block.frequency_parameter
    eta = restitution_ratio(block, task.restitution)
    pieces = list(task.pulse.pieces) if task.pulse is not None else []
    shaking = float(pieces[-1][T1]) if pieces else 0.0
    stop = math.inf if task.duration is None else task.duration
    still = STILL.copy()
    still[T0] = shaking
    t, phi, v = 0.0, abs(task.rotation), 0.0
    side = math.copysign(1.0, task.rotation or task.rate) if task.rotation or task.rate else 0.0
    v = side * task.rate
    uplift = 0.0 if side else None
    impacts: list[float] = []
    rates: list[float] = []
    legs: list[tuple[float, float, Dense]] = []
    peak, overturning = phi, None
    for piece in [*pieces, still]:
        end = min(float(piece[T1]), stop)
        while t < end and overturning is None and len(impacts) < MOST_IMPACTS:
            if side == 0.0:
                if piece is still:
                    break
                lift = first_uplift(piece, t, end, block.uplift_acceleration)
                if lift < 0.0:
                    t = end
                    break
                uplift = lift if uplift is None else uplift
                t, phi, v = lift, 0.0, 0.0
                side = -1.0 if base_acceleration(piece, lift) > 0.0 else 1.0
            started = t
            t, phi, v, code, dense = flyer.fly(t, phi, v, side, piece, min(end, t + LONGEST / p))
            legs.append((started, side, dense))
            peak = max(peak, phi)
            if code == FALLEN:
                overturning = t
            elif code == CONTACT:
                impacts.append(t)
                rates.append(side * v)
                phi, v, side = 0.0, -eta * v, -side
                if v < REST_RATE * p:
                    side = 0.0
            elif t < end:
                break
    over = overturning is not None or side == 0.0
    falls = overturning is not None
    if not falls and side != 0.0:
        ahead, around = barrier_margins(block.slenderness, eta, block.slenderness - phi, v / p)
        falls = ahead > 0.0 or around > 0.0
    lying = side * HALF_TURN if overturning is not None else 0.0
    return Answer(
        uplift=uplift,
        impacts=np.array(impacts),
        rates=np.array(rates),
        rest=None,
        overturning=overturning,
        overturned=falls,
        peak=HALF_TURN if overturning is not None else peak,
        stated=STATED,
        end=math.inf if over else t,
        rotation=partial(_rotation, legs, t if over else math.inf, lying),
    )


def _rotation(legs: list[tuple[float, float, Dense]], last: float, lying: float, times: FloatArray) -> FloatArray:
    result = np.zeros_like(times)
    starts = [leg[0] for leg in legs]
    which = np.searchsorted(starts, times, side="right") - 1
    for k in np.unique(which[(which >= 0) & (times < last)]):
        inside = (which == k) & (times < last)
        result[inside] = legs[k][1] * legs[k][2](times[inside])
    result[times >= last] = lying
    return result
