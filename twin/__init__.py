"""A shake-table digital twin for rocking blocks.

`from twin import Block, simulate` is all a script needs; nothing heavy is imported before it is asked for.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from twin.rocking.block import Block
    from twin.rocking.response import Outcome, Response
    from twin.simulation import simulate

__all__ = ["Block", "Outcome", "Response", "simulate"]

_HOMES = {
    "Block": "twin.rocking.block",
    "Outcome": "twin.rocking.response",
    "Response": "twin.rocking.response",
    "simulate": "twin.simulation",
}


def __getattr__(name: str) -> object:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(_HOMES[name]), name)
