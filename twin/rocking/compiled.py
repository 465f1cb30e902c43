"""The one place that knows the compiler: a typed `@compiled`, its cache kept where the installation can be written."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, ParamSpec, TypeVar, cast

import numba  # pyright: ignore[reportMissingTypeStubs]
import numpy as np
from numpy.typing import NDArray

P = ParamSpec("P")
R = TypeVar("R")

FloatArray = NDArray[np.float64]


def compiled(function: Callable[P, R]) -> Callable[P, R]:
    """Compile to machine code at first use and keep the result on disk.

    Strict IEEE arithmetic (no fast-math, no contraction), so that equal processors give equal bits. Numba keeps the
    code beside the module, or in the user's cache folder where that is not writable; where neither is, it is compiled
    anew in each process.
    """
    jit = cast("Callable[..., Callable[[Callable[P, R]], Any]]", numba.njit)
    options: dict[str, Any] = {"nogil": True, "error_model": "numpy"}
    try:
        return cast("Callable[P, R]", jit(cache=True, **options)(function))
    except RuntimeError:  # numba: "cannot cache function: no locator available"
        return cast("Callable[P, R]", jit(**options)(function))
