"""The seam between `simulate` and its methods: what is asked, what is answered, and how a method says no."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from twin.rocking.block import Block
from twin.rocking.compiled import FloatArray

NONLINEAR, QUASI_LINEAR, LINEARISED = "nonlinear", "quasi-linear", "linearised"
MODELS = (NONLINEAR, QUASI_LINEAR, LINEARISED)
"""The equations, richest first: in full; for small rotation; for small rotation and small slenderness."""


class MethodRefused(ValueError):  # noqa: N818 -- a refusal is an answer
    """A method cannot do what is asked within what it states: one sentence says why."""


@dataclass(frozen=True, slots=True)
class Problem:
    """One run, every number checked.

    Attributes
    ----------
    block : Block
    eta : float
        Ratio of angular velocities after and before an impact.
    pieces : ndarray, shape (n, 7)
        Rows of the pulse; none where the base stands still.
    rotation, rate : float
        At time 0, rad and rad/s, signed.
    end : float
        Time the run ends, s; infinite: until the block rests or lies.
    tolerance : float
        Absolute error of the rotation asked for, rad.
    step : float or None
        Time step of a method with a fixed one, s; None: its own choice.
    model : str
        One of `MODELS`.
    """

    block: Block
    eta: float
    pieces: FloatArray
    rotation: float
    rate: float
    end: float
    tolerance: float
    step: float | None
    model: str

    @property
    def shaking(self) -> float:
        """Time the base stands still from, s."""
        return float(self.pieces[-1, 1]) if len(self.pieces) else 0.0


class History(Protocol):
    """The motion in time."""

    def evaluate(self, times: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return rotation (rad) and angular velocity (rad/s), signed, at `times` (s, one axis, up to `end_time`)."""
        ...


@dataclass(frozen=True, slots=True)
class Solution:
    """What a method found; see `Response` for the meaning of each number.

    `overturned` is None where the method's error, or one rounding of an input, decides. `overturning_time` is when
    the motion given reaches pi/2 on side `side` (+1 or -1), whatever the verdict; `resting` is whether the block stands
    still from `rest_time` on (or never moved).
    """

    uplift_time: float | None
    impact_times: FloatArray
    impact_rates: FloatArray
    rest_time: float | None
    overturning_time: float | None
    side: int
    overturned: bool | None
    resting: bool
    peak: float
    error: float
    end_time: float
    history: History


class Method(Protocol):
    """One way to solve a problem: a small module each, its source in the docstring.

    1. `solve` returns a solution whose numbers are right within `Solution.error` (rad, along the run), or raises
       `MethodRefused`; it never returns a wrong answer without saying so.
    2. Equal problems give equal bits.
    3. No state is kept between calls.
    """

    @property
    def name(self) -> str:
        """What `simulate(method=...)` calls it."""
        ...

    @property
    def models(self) -> tuple[str, ...]:
        """The equations it can solve."""
        ...

    @property
    def source(self) -> str:
        """Author, year, where."""
        ...

    def solve(self, problem: Problem) -> Solution:
        """Return the answer, or raise `MethodRefused`."""
        ...
