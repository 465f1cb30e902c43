"""Opening a released machine on any CAN bus: which nodes it has, and how the host reads them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from devices.released_table import ReleasedTable
from devices.sensors.reading import base_acceleration, base_position, rotation_by_displacements, rotation_by_encoder

if TYPE_CHECKING:
    from collections.abc import Callable

    from devices.cia301.buses import CanBus
    from devices.clock import Clock
    from excitation import Capacity

RELEASE_NODE, POSITION_NODE, ACCELERATION_NODE, ROTATION_NODE, INCLINOMETER_NODE = 1, 2, 3, 4, 5
"""CANopen nodes of a released machine."""


def open_released(
    bus: CanBus,
    capacity: Capacity,
    *,
    air: bool,
    cycle_time: float,
    clock: Clock | None,
    idle: Callable[[], None] | None,
    rotation: bool,
    beams: float | None,
    inclinometer: bool,
    time_limit: float,
    state_limit: float,
) -> ReleasedTable:
    """Connect to a released machine; nothing moves. Parameters as of the drivers, which call it."""
    sensor = None
    if rotation:
        node = ROTATION_NODE
        sensor = rotation_by_encoder(node) if beams is None else rotation_by_displacements(node, beams)
    table = ReleasedTable(
        bus,
        capacity,
        release_node=RELEASE_NODE,
        position=base_position(POSITION_NODE),
        acceleration=base_acceleration(ACCELERATION_NODE),
        rotation=sensor,
        inclinometer_node=INCLINOMETER_NODE if inclinometer else None,
        air=air,
        cycle_time=cycle_time,
        clock=clock,
        idle=idle,
        time_limit=time_limit,
        state_limit=state_limit,
    )
    table.open()
    return table
