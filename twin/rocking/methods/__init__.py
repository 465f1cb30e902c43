"""The methods of `simulate`, side by side: each a small module that answers a `Problem` with a `Solution`."""

from __future__ import annotations

from functools import cache
from importlib import import_module
from typing import cast

import numpy as np

from twin.rocking.methods.problem import (
    MODELS,
    NONLINEAR,
    QUASI_LINEAR,
    History,
    Method,
    MethodRefused,
    Problem,
    Solution,
)
from twin.rocking.series import AMPLITUDE, C1

__all__ = ["METHODS", "MODELS", "History", "Method", "MethodRefused", "Problem", "Solution", "default_method", "method"]

# Name -> (module, class); a module is imported when asked for, so that its machine code is not loaded in vain.
METHODS = {
    "taylor": ("taylor", "Taylor"),
    "closed-form": ("closed_form", "ClosedForm"),
    "dop853": ("dop853", "Dop853"),
    "rk4": ("rk4", "RungeKutta4"),
    "newmark": ("newmark", "Newmark"),
}


@cache
def method(name: str) -> Method:
    """Return the method called `name`.

    Raises
    ------
    ValueError
        Where there is none of that name.
    """
    if name not in METHODS:
        raise ValueError(f"there is no method {name!r}; there are {', '.join(METHODS)}")
    module, kind = METHODS[name]
    found = getattr(import_module(f"twin.rocking.methods.{module}"), kind)
    return cast("Method", found())


def default_method(problem: Problem) -> str:
    """Return the name of the method for a problem where none is asked for: the most accurate, then the fastest."""
    if problem.model == NONLINEAR:
        return "taylor"
    if problem.model == QUASI_LINEAR and np.any(problem.pieces[:, (C1, AMPLITUDE)]):
        return "dop853"
    return "closed-form"
