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
    *,
    capacity: Capacity,
    air: bool,
    cycle_time: float = 1e-3,
    clock: Clock | None = None,
    idle: Callable[[], None] | None = None,
    rotation: bool = True,
    beams: float | None = None,
    inclinometer: bool = False,
    time_limit: float = 0.02,
    state_limit: float = 30.0,
    stop_deceleration: float | None = None,  # noqa: ARG001 - the same call for every table
    following_error: float | None = None,  # noqa: ARG001
) -> ReleasedTable:
    """Connect to a machine that is set by hand and released; nothing moves.

    A device's `open_table` is this with its own `capacity` and `air`.

    Parameters
    ----------
    bus : CanBus
        Open bus; it stays open when the table is closed.
    capacity : excitation.Capacity
        Of your machine; the numbers that ship are placeholders.
    air : bool
        Whether the machine rides on air, which a stop takes away.
    cycle_time : float
        s.
    clock : Clock, optional
        The wall clock unless told.
    idle : callable, optional
        `service` of an emulator in this process; nothing for a real machine or another process.
    rotation : bool
        Whether a rotation sensor answers, as node 4.
    beams : float, optional
        Distance between the two displacement sensors that stand for it, m; an encoder unless told.
    inclinometer : bool
        Whether there is one on the block, as node 5.
    time_limit : float
        For all answers to one SYNC, s.
    state_limit : float
        For arming, or for a stop, s; longer than the base takes to come to rest.
    stop_deceleration, following_error : float, optional
        Not used: there is no drive to be set up.

    Returns
    -------
    ReleasedTable
        Open; a `with` block closes it.

    Raises
    ------
    DeviceTimeout
        Where nobody answers.
    """
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
