"""The one place that knows the compiler: a typed `@compiled`, its cache kept where the installation can be written."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from pathlib import Path
from typing import Any, ParamSpec, TypeVar, cast

import numba  # pyright: ignore[reportMissingTypeStubs]
import numpy as np
from numpy.typing import NDArray

P = ParamSpec("P")
R = TypeVar("R")

FloatArray = NDArray[np.float64]


def source_digest(folder: Path) -> str:
    """Return a digest of every module in `folder` and below."""
    digest = hashlib.sha256()
    for path in sorted(folder.rglob("*.py")):
        digest.update(str(path.relative_to(folder)).encode() + path.read_bytes().replace(b"\r\n", b"\n"))
    return digest.hexdigest()


SOURCE_DIGEST = source_digest(Path(__file__).parent)
"""Of every module of the solver: what its compiled code, and its predictions, depend on."""


def compiled(function: Callable[P, R]) -> Callable[P, R]:
    """Compile to machine code at first use and keep the result on disk.

    Strict IEEE arithmetic (no fast-math, no contraction), so that equal processors give equal bits. Numba keeps the
    code beside the module, or in the user's cache folder where that is not writable; where neither is, it is compiled
    anew in each process. Kept code is used only while *no* module of the solver has changed: Numba itself looks at the
    function's own file alone, and would go on calling an old version of what that file imports.
    """
    return compiled_with(function)


def compiled_with(function: Callable[P, R], sources: str = SOURCE_DIGEST, **more: Any) -> Callable[P, R]:
    """Compile as `compiled` does, with `more` options of Numba's; kept while `sources` is the same."""
    jit = cast("Callable[..., Callable[[Callable[P, R]], Any]]", numba.njit)
    options: dict[str, Any] = {"nogil": True, "error_model": "numpy", **more}
    try:
        dispatcher = jit(cache=True, **options)(function)
        index = dispatcher._cache._cache_file  # pyright: ignore[reportPrivateUsage]
        index._source_stamp = (index._source_stamp, sources)  # pyright: ignore[reportPrivateUsage]
    except (RuntimeError, AttributeError):  # numba: "cannot cache function: no locator available"; or another numba
        return cast("Callable[P, R]", jit(**options)(function))
    return cast("Callable[P, R]", dispatcher)
