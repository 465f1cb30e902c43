"""A shake-table digital twin for rocking blocks.

`from twin import Block, simulate` is all a script needs; nothing heavy is imported before it is asked for.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from twin.map.overturning import OverturningMap, overturning_map
    from twin.rocking.block import Block
    from twin.rocking.response import Outcome, Response
    from twin.simulation import simulate
    from twin.stack.response import StackResponse
    from twin.stack.stack import Stack

__all__ = ["Block", "Outcome", "OverturningMap", "Response", "Stack", "StackResponse", "overturning_map", "simulate"]

_HOMES = {
    "Block": "twin.rocking.block",
    "Outcome": "twin.rocking.response",
    "OverturningMap": "twin.map.overturning",
    "Response": "twin.rocking.response",
    "Stack": "twin.stack.stack",
    "StackResponse": "twin.stack.response",
    "overturning_map": "twin.map.overturning",
    "simulate": "twin.simulation",
}


def __getattr__(name: str) -> object:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(_HOMES[name]), name)
