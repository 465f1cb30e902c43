"""An independent solution of the saturated table: a hybrid automaton on SciPy's DOP853, every transition an event.

It shares no code with `devices.quanser_st3.mechanics`: regimes are explicit states that change by the event that fired,
not by looking at the state again.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from scipy.integrate import solve_ivp

from devices.quanser_st3.parameters import St3Parameters

_TINY = 1e-9


class Automaton:
    """The table under set-points `positions`, m, one every `step` s, from rest at 0."""

    def __init__(
        self, parameters: St3Parameters, payload: float, half_stroke: float, positions: np.ndarray, step: float
    ) -> None:
        p, mass = parameters, parameters.moving_mass + payload
        self.times, self.positions, self.delay, self.step = np.arange(len(positions)) * step, positions, p.delay, step
        # M x'' = M0 (w0^2 (r - x) - 2 zeta0 w0 x'), written out
        w0 = math.tau * p.loop_frequency
        self.k = p.moving_mass * w0**2 / mass
        self.c = p.moving_mass * 2 * p.loop_damping * w0 / mass
        self.most = math.tau * p.torque_constant / p.screw_lead * p.peak_current / mass
        self.top, self.switch = p.top_speed, half_stroke + p.switch_distance
        self.bumper = half_stroke + p.bumper_distance
        self.bk, self.bc = p.bumper_stiffness / mass, p.bumper_damping / mass
        self.saturated = self.side = self.wants = self.too_fast = self.beyond = 0
        self.events = 0

    def asked(self, t: float, s: np.ndarray) -> float:
        r = float(np.interp(t - self.delay, self.times, self.positions))
        return self.k * (r - s[0]) - self.c * s[1]

    def push(self, s: np.ndarray, side: int) -> float:
        return self.bk * (side * s[0] - self.bumper) + self.bc * side * s[1]

    @property
    def cut(self) -> bool:
        return self.wants != 0 and self.wants in (self.too_fast, self.beyond)

    def rate(self, t: float, s: np.ndarray) -> list[float]:
        drive = 0.0 if self.cut else self.saturated * self.most if self.saturated else self.asked(t, s)
        return [s[1], drive - self.side * self.push(s, self.side)]

    def guards(self) -> dict[str, Callable[[float, np.ndarray], float]]:
        found: dict[str, Callable[[float, np.ndarray], float]] = {
            "asked": self.asked,
            "most +": lambda t, s: self.asked(t, s) - self.most,
            "most -": lambda t, s: self.asked(t, s) + self.most,
            "switch +": lambda _, s: s[0] - self.switch,
            "switch -": lambda _, s: s[0] + self.switch,
        }
        # While nothing acts at the top speed, it stays what it is, and its last bit says nothing; a bumper ends that.
        if not (self.cut and self.too_fast):
            found |= {"top +": lambda _, s: s[1] - self.top, "top -": lambda _, s: s[1] + self.top}
        if self.side:
            found["push"] = lambda _, s: self.push(s, self.side)
        else:
            found |= {"bumper +": lambda _, s: s[0] - self.bumper, "bumper -": lambda _, s: s[0] + self.bumper}
        return found

    def change(self, name: str, rises: bool) -> None:
        if name == "asked":
            self.wants, self.too_fast = (1 if rises else -1), 0
        elif name == "most +":
            self.saturated = 1 if rises else 0
        elif name == "most -":
            self.saturated = 0 if rises else -1
        elif name == "top +":
            self.too_fast = 1 if rises else 0
        elif name == "top -":
            self.too_fast = 0 if rises else -1
        elif name == "switch +":
            self.beyond = 1 if rises else 0
        elif name == "switch -":
            self.beyond = 0 if rises else -1
        elif name == "bumper +" and rises:
            self.side, self.too_fast = 1, 0
        elif name == "bumper -" and not rises:
            self.side, self.too_fast = -1, 0
        elif name == "push" and not rises:
            self.side = 0

    def run(self) -> np.ndarray:
        """Return position and velocity at the last set-point's time."""
        end, part = self.times[-1], self.delay % self.step
        knots = sorted({float(t + d) for t in self.times for d in (0.0, part) if 0.0 < t + d < end} | {float(end)})
        t, s, blind = 0.0, np.zeros(2), True
        for knot in knots:
            while t < knot - 1e-15:
                # SciPy finds an event at its own start again: the first instant after one is done without events.
                unseen = 1e-5 if self.wants == 0 else 1e-7 if blind else math.inf
                until, blind = min(t + unseen, knot), False
                guards = self.guards() if unseen == math.inf else {}
                done = solve_ivp(
                    self.rate, (t, until), s, "DOP853", rtol=1e-12, atol=1e-15, max_step=1e-4,
                    events=[_terminal(g) for g in guards.values()],
                )  # fmt: skip
                t, s = float(done.t[-1]), done.y[:, -1]
                if self.wants == 0 and abs(self.asked(t, s)) > 1e-12:
                    self.wants = 1 if self.asked(t, s) > 0.0 else -1
                if done.status == 1:
                    ahead = s + _TINY * np.array(self.rate(t, s))
                    fired = [name for name, times in zip(guards, done.t_events, strict=True) if len(times)]
                    rising = [guards[name](t + _TINY, ahead) > 0.0 for name in fired]
                    for name, rises in zip(fired, rising, strict=True):
                        self.change(name, rises)
                    self.events += 1
                    blind = True
        return s


def _terminal(guard: Callable[[float, np.ndarray], float]) -> Callable[[float, np.ndarray], float]:
    def event(t: float, s: np.ndarray) -> float:
        return guard(t, s)

    event.terminal = True  # type: ignore[attr-defined]
    return event
