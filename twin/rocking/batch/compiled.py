"""The batch kernel's own compiler option: arrays are lent to its functions, not counted."""

from __future__ import annotations

from collections.abc import Callable
from typing import ParamSpec, TypeVar

from twin.rocking.compiled import compiled_with

P = ParamSpec("P")
R = TypeVar("R")


def lent(function: Callable[P, R]) -> Callable[P, R]:
    """Compile as `compiled` does, for a function that makes no array and keeps none.

    Counting an array's owners at every call took 45 % of the kernel's time (two atomic operations an array and call).
    The caller holds what it lends until the function returns. The option is Numba's own and undocumented.
    """
    return compiled_with(function, _nrt=False)
