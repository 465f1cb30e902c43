"""One flight of the block by each peer; see `twin.chart.peers`.

In all of them y = (phi, v), phi = |theta| in rad and v in rad/s on one side, with the contact (phi falling through 0)
and pi/2 (phi rising through it) as terminal events by the package's own rule.
"""

from __future__ import annotations

import math
import warnings
from functools import lru_cache, partial
from importlib import import_module
from typing import Any

import numpy as np

from twin.chart.task import HALF_TURN, Task
from twin.rocking.compiled import FloatArray
from twin.rocking.series import AMPLITUDE, C0, C1, OMEGA, PHASE, T0

REACHED, CONTACT, FALLEN = 0, 1, 2
CVODE_EVENT = 2  # SUNDIALS' CV_ROOT_RETURN; the events of an earlier call stay in its result otherwise


class PeerFailed(ValueError):  # noqa: N818 -- a refusal is an answer
    """A peer gave up: its own words."""


def _event(level: float, direction: int) -> Any:
    """Return SciPy's kind of event: phi passes `level`, and the run stops there."""

    def event(_: float, y: Any) -> float:
        return float(y[0]) - level

    marked: Any = event
    marked.terminal, marked.direction = True, direction
    return marked


class ScipyFlyer:
    """`scipy.integrate.solve_ivp`, DOP853, with `events` as its manual shows."""

    def __init__(self, task: Task, tolerance: float) -> None:
        self._solve: Any = import_module("scipy.integrate").solve_ivp
        self._rates = _Equation(task)
        self._tolerance = tolerance
        self._events = (_event(0.0, -1), _event(HALF_TURN, 1))

    def fly(self, t: float, phi: float, v: float, side: float, piece: FloatArray, end: float) -> Any:
        """See `twin.chart.peers.Flyer`."""
        self._rates.take(piece, side)
        result = self._solve(
            self._rates.slopes,
            (t, end),
            [phi, v],
            "DOP853",
            rtol=self._tolerance,
            atol=self._tolerance,
            events=self._events,
            dense_output=True,
        )
        if result.status < 0:
            raise PeerFailed(f"SciPy: {result.message}")
        code = REACHED
        if result.status == 1:
            code = CONTACT if result.t_events[0].size else FALLEN

        def dense(times: FloatArray) -> FloatArray:
            return np.asarray(result.sol(times)[0])

        return float(result.t[-1]), float(result.y[0, -1]), float(result.y[1, -1]), code, dense


class CvodeFlyer:
    """CVODE (Adams) through scikit-sundae, with its `eventsfn`."""

    def __init__(self, task: Task, tolerance: float) -> None:
        self._rates = _Equation(task)

        def events(_: float, y: Any, g: Any) -> None:
            g[0] = y[0]
            g[1] = y[0] - HALF_TURN

        marked: Any = events
        marked.terminal, marked.direction = [True, True], [-1, 1]
        kind: Any = import_module("sksundae.cvode").CVODE
        make = partial(
            kind, self._rates.fill, method="Adams", rtol=max(tolerance, 1e-15), atol=tolerance, max_num_steps=100_000
        )
        self._solver: Any = make(eventsfn=marked, num_events=2)
        self._plain: Any = make()

    def fly(self, t: float, phi: float, v: float, side: float, piece: FloatArray, end: float) -> Any:
        """See `twin.chart.peers.Flyer`."""
        self._rates.take(piece, side)
        try:
            result = self._solver.solve(np.array([t, end]), np.array([phi, v]))
        except (RuntimeError, ValueError) as error:
            raise PeerFailed(f"CVODE: {error}") from None
        if not result.success:
            raise PeerFailed(f"CVODE: {result.message}")
        code = REACHED
        if result.status == CVODE_EVENT:
            code = CONTACT if result.y[-1, 0] < 0.5 * HALF_TURN else FALLEN

        def dense(times: FloatArray) -> FloatArray:
            self._rates.take(piece, side)
            later = times[times > t]
            if not later.size:
                return np.full(times.size, phi)
            moved = self._plain.solve(np.concatenate([[t], np.unique(later)]), np.array([phi, v]))
            return np.asarray(np.interp(times, moved.t, moved.y[:, 0]), dtype=np.float64)

        return float(result.t[-1]), float(result.y[-1, 0]), float(result.y[-1, 1]), code, dense


class HeyokaFlyer:
    """heyoka's adaptive Taylor integrator with terminal events, their cooldowns kept within a run."""

    def __init__(self, task: Task, tolerance: float) -> None:
        self._hy: Any = import_module("heyoka")
        self._solver, self._plain = _heyoka(tolerance)
        self._solver.reset_cooldowns()
        block = task.block
        self._fixed = (block.slenderness, block.frequency_parameter**2, block.gravity)

    def fly(self, t: float, phi: float, v: float, side: float, piece: FloatArray, end: float) -> Any:
        """See `twin.chart.peers.Flyer`."""
        alpha, square, gravity = self._fixed
        pars = [alpha, square, side / gravity, *(float(piece[k]) for k in (T0, C0, C1, AMPLITUDE, OMEGA, PHASE))]
        solver = self._solver
        solver.time = t
        solver.state[:] = (phi, v)
        solver.pars[:] = pars
        outcome = int(solver.propagate_until(end)[0])
        if outcome == int(self._hy.taylor_outcome.err_nf_state):
            raise PeerFailed("heyoka: the state is no longer finite")
        code = {-1: CONTACT, -2: FALLEN}.get(outcome, REACHED)

        def dense(times: FloatArray) -> FloatArray:
            plain = self._plain
            plain.time = t
            plain.state[:] = (phi, v)
            plain.pars[:] = pars
            grid = np.unique(np.concatenate([[t], times[times >= t]]))
            states = plain.propagate_grid(grid)[-1]
            return np.asarray(np.interp(times, grid, states[:, 0]), dtype=np.float64)

        return float(solver.time), float(solver.state[0]), float(solver.state[1]), code, dense


@lru_cache(maxsize=16)
def _heyoka(tolerance: float) -> tuple[Any, Any]:
    """Return the compiled integrator with events and the one without."""
    hy: Any = import_module("heyoka")
    phi, v = hy.make_vars("phi", "v")
    par = hy.par
    x = hy.time - par[3]
    a = par[4] + par[5] * x + par[6] * hy.sin(par[7] * x + par[8])
    system = [(phi, v), (v, -par[1] * (hy.sin(par[0] - phi) + par[2] * a * hy.cos(par[0] - phi)))]
    events = [
        hy.t_event(phi, direction=hy.event_direction.negative),
        hy.t_event(phi - 0.5 * math.pi, direction=hy.event_direction.positive),
    ]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        whole = hy.taylor_adaptive(system, [0.1, 0.0], pars=[0.0] * 9, t_events=events, tol=tolerance)
        plain = hy.taylor_adaptive(system, [0.1, 0.0], pars=[0.0] * 9, tol=tolerance)
    return whole, plain


class _Equation:
    """phi'' = -p^2 (sin(alpha - phi) + s a / g cos(alpha - phi)), as Python functions."""

    def __init__(self, task: Task) -> None:
        self._alpha = task.block.slenderness
        self._square = task.block.frequency_parameter**2
        self._gravity = task.block.gravity
        self._piece: tuple[float, ...] = ()
        self._share = 0.0

    def take(self, piece: FloatArray, side: float) -> None:
        """Use this row of the pulse, on this side, from now on."""
        self._piece = tuple(float(piece[k]) for k in (T0, C0, C1, AMPLITUDE, OMEGA, PHASE))
        self._share = side / self._gravity

    def slopes(self, t: float, y: Any) -> tuple[float, float]:
        """Return the slopes of (phi, v)."""
        t0, c0, c1, amplitude, omega, psi = self._piece
        a = c0 + c1 * (t - t0) + amplitude * math.sin(omega * (t - t0) + psi)
        angle = self._alpha - float(y[0])
        return float(y[1]), -self._square * (math.sin(angle) + self._share * a * math.cos(angle))

    def fill(self, t: float, y: Any, slopes: Any) -> None:
        """Write the slopes of (phi, v)."""
        slopes[0], slopes[1] = self.slopes(t, y)
