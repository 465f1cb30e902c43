"""The largest factor that keeps a pulse within a capacity."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Callable

# An asked pulse may pass a limit by this share: its own numbers carry as much rounding.
ROUNDING: Final = 1e-12

# A reduced pulse stays this share below its limits, so that it is still within them in anyone else's arithmetic, and
# after being moved to another place in time and on the table. 2e-12 m in a stroke of 0.2 m: no table sees it.
GUARD: Final = 1e-11

_EVALUATIONS: Final = 100

# Factors below this are not stepped through but halved.
LOWEST_STRIDE: Final = 1e-3


def largest_factor(
    worst: Callable[[float], float], smallest: float = 1e-15, stride: float | None = None
) -> float | None:
    """Return the largest factor from `smallest` to 1 with worst(factor) <= 1, or None where there is none.

    1 is returned where it holds within `ROUNDING`; otherwise worst(factor) lies between 1 - 3 GUARD and 1 - GUARD where
    `worst` is continuous. Where `worst` is not monotone the factor holds all the same, but a larger one may too, unless
    `stride` steps over it.

    Parameters
    ----------
    worst : callable
        Largest fraction of any limit that the pulse reduced by the factor uses; grows with the factor.
    smallest : float
        Least factor worth trying, from 0 to 1.
    stride : float, optional
        Ratio, below 1, of the factors tried from 1 down to `LOWEST_STRIDE` before the bracket is made more precise;
        where worst(smallest) does not hold, nothing is taken to.

    Examples
    --------
    >>> round(largest_factor(lambda f: 2 * f + f**2), 9)
    0.414213562
    """
    aim = 1.0 - 2.0 * GUARD
    upper, above = 1.0, worst(1.0) - aim
    if above <= 1.0 + ROUNDING - aim:
        return 1.0
    if stride is not None:
        if worst(smallest) - aim > GUARD:
            return None
        lower = stride
        while lower > LOWEST_STRIDE and (below := worst(lower) - aim) > GUARD:
            upper, above = lower, below
            lower *= stride
    else:
        # Exact where everything is proportional to the factor, below the answer where something grows faster.
        lower = max(aim / (above + aim), smallest)
    while (below := worst(lower) - aim) > GUARD:
        if lower <= smallest:
            return None
        upper, above = lower, below
        lower = max(0.5 * lower, smallest)
    found, side = below >= -GUARD, 0
    for evaluation in range(_EVALUATIONS):
        if found or upper - lower <= 1e-15 * upper:
            break
        # False position in its Illinois form, and a bisection now and then for what is not smooth.
        middle = (lower * above - upper * below) / (above - below)
        if evaluation % 4 == 3 or not lower < middle < upper:
            middle = 0.5 * (lower + upper)
        there = worst(middle) - aim
        if there > GUARD:
            upper, above = middle, there
            below *= 0.5 if side > 0 else 1.0
            side = 1
        else:
            lower, below = middle, there
            above *= 0.5 if side < 0 else 1.0
            side, found = -1, there >= -GUARD
    return lower
