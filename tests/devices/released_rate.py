"""Released machines as ordinary differential equations, solved by SciPy: nothing of the closed forms is used here."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from scipy.integrate import solve_ivp

if TYPE_CHECKING:
    from collections.abc import Callable

TIGHT = {"method": "DOP853", "rtol": 1e-12, "atol": 1e-14}


class Stretch(NamedTuple):
    """A part of the motion: a(t) from its start, how long at most, and where it ends before that."""

    acceleration: Callable[[float], float]
    longest: float
    until_position: float = math.inf


def shape_of(name: str) -> Callable[[float], float]:
    """Return a shape over 0 to 1 with mean 1."""
    return {
        "half sine": lambda u: 0.5 * math.pi * math.sin(math.pi * u),
        "rectangular": lambda _: 1.0,
        "triangular": lambda u: 2.0 * (1.0 - abs(2.0 * u - 1.0)),
    }[name]


class Trajectory:
    """Where the base is at every time after its release; each stretch is made from the velocity it begins with."""

    def __init__(self, stretches: list[Callable[[float], Stretch | None]]) -> None:
        self._parts: list[tuple[float, float, object]] = []
        self.end = (0.0, 0.0, 0.0)
        for make in stretches:
            if (stretch := make(self.end[2])) is not None:
                self._follow(stretch)

    def _follow(self, stretch: Stretch) -> None:
        """Integrate a stretch from where the one before ended, in two halves: a triangle has a kink in the middle."""

        def rate(t: float, z: np.ndarray) -> list[float]:
            return [z[1], stretch.acceleration(t)]

        def arrives(t: float, z: np.ndarray) -> float:
            return z[0] - stretch.until_position if math.isfinite(stretch.until_position) else 1.0

        arrives.terminal = True
        begun = self.end[0]
        for start, stop in ((0.0, 0.5 * stretch.longest), (0.5 * stretch.longest, stretch.longest)):
            part = solve_ivp(rate, (start, stop), list(self.end[1:]), events=[arrives], dense_output=True, **TIGHT)
            assert part.success
            self.end = (begun + float(part.t[-1]), *map(float, part.y[:, -1]))
            self._parts.append((begun + start, begun, part.sol))
            if part.status == 1:
                return

    def __call__(self, time: float) -> tuple[float, float]:
        if time >= self.end[0]:
            return self.end[1:]
        _, begun, solution = [part for part in self._parts if part[0] <= time][-1]
        x, v = solution(time - begun)
        return float(x), float(v)
