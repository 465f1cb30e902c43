"""What the emulated ROORI1 measures with, and a user's own `[emulator]` table."""

from __future__ import annotations

from typing import TYPE_CHECKING

from devices.own_table import read_own
from devices.released_parameters import MeasuringParameters

if TYPE_CHECKING:
    from collections.abc import Mapping


def load_parameters(table: Mapping[str, object]) -> MeasuringParameters:
    """Return the parameters with a user's own numbers in them; ValueError, one sentence, where they make no sense."""
    return read_own(MeasuringParameters, table, "emulator")
