"""`@compiled` for this folder: kept while no module here or in the solver has changed."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import ParamSpec, TypeVar

from twin.rocking.compiled import SOURCE_DIGEST, compiled_with, source_digest

P = ParamSpec("P")
R = TypeVar("R")

_SOURCES = SOURCE_DIGEST + source_digest(Path(__file__).parent)


def compiled(function: Callable[P, R]) -> Callable[P, R]:
    """Compile as `twin.rocking.compiled.compiled` does."""
    return compiled_with(function, _SOURCES)
