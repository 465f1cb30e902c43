"""What the emulated air track measures with, and a user's own `[emulator]` table."""

from __future__ import annotations

from typing import TYPE_CHECKING

from devices.air_track.settings import AirTrackMachine
from devices.own_table import read_own
from devices.released_parameters import MeasuringParameters

if TYPE_CHECKING:
    from collections.abc import Mapping

    from excitation import Capacity

# Share of the cart's mass up to which a block is passed over.
_LIGHT = 0.05


class AirTrackParameters(MeasuringParameters):
    """Sensors and latch of the emulated air track.

    Examples
    --------
    >>> from devices.air_track.capacity import CAPACITY
    >>> AirTrackParameters().notes(CAPACITY, 2.5)
    ['the block, 2.5 kg, is not light beside the cart, 10 kg: how its rocking pushes the cart is not imitated']
    """

    def notes(self, capacity: Capacity, payload: float) -> list[str]:
        """Say where the block is too heavy for its reaction on the cart to be left out."""
        machine = capacity.machine
        if not isinstance(machine, AirTrackMachine) or payload <= _LIGHT * machine.cart:
            return []
        return [
            f"the block, {payload:g} kg, is not light beside the cart, {machine.cart:g} kg: "
            "how its rocking pushes the cart is not imitated"
        ]


def load_parameters(table: Mapping[str, object]) -> AirTrackParameters:
    """Return the parameters with a user's own numbers in them; ValueError, one sentence, where they make no sense."""
    return read_own(AirTrackParameters, table, "emulator")
