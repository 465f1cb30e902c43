"""The stack's compiled functions: kept while no module of the stack or of the single block has changed."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import ParamSpec, TypeVar

from twin.rocking.compiled import SOURCE_DIGEST, compiled_with, source_digest

P = ParamSpec("P")
R = TypeVar("R")

SOURCES = SOURCE_DIGEST + source_digest(Path(__file__).parent)


def compiled(function: Callable[P, R]) -> Callable[P, R]:
    """Compile as `twin.rocking.compiled.compiled` does."""
    return compiled_with(function, SOURCES)


def lent(function: Callable[P, R]) -> Callable[P, R]:
    """Compile a function that makes no array and keeps none: arrays are lent to it, not counted."""
    return compiled_with(function, SOURCES, _nrt=False)
