"""The ST-III over CiA 402 on any CAN bus."""

from __future__ import annotations

from typing import TYPE_CHECKING

from devices.cia402.master import Cia402Table
from devices.quanser_st3.capacity import CAPACITY

if TYPE_CHECKING:
    from collections.abc import Callable

    from devices.cia301.buses import CanBus
    from devices.clock import Clock
    from excitation import Capacity

DRIVE_NODE, SENSOR_NODE = 1, 2
"""CANopen nodes of the drive and of the specimen's rotation sensor."""


def open_table(
    bus: CanBus,
    *,
    capacity: Capacity = CAPACITY,
    cycle_time: float = 1e-3,
    clock: Clock | None = None,
    idle: Callable[[], None] | None = None,
    rotation: bool = True,
    time_limit: float = 0.02,
    state_limit: float = 3.0,
    stop_deceleration: float | None = None,
    following_error: float | None = None,
    patience: float | None = None,
) -> Cia402Table:
    """Connect to an ST-III; nothing moves.

    Parameters
    ----------
    bus : CanBus
        Open bus; it stays open when the table is closed.
    capacity : excitation.Capacity
        Of your table; the default numbers are placeholders.
    cycle_time : float
        s.
    clock : Clock, optional
        The wall clock unless told.
    idle : callable, optional
        `EmulatedSt3.service` of an emulator in this process; nothing for a real table or another process.
    rotation : bool
        Whether a rotation sensor answers, as node 2.
    time_limit : float
        For all answers to one SYNC, s.
    state_limit : float
        For a walk through the drive's states or a stop, s; longer than the drive's slowest quick stop.
    stop_deceleration : float, optional
        Of the drive's quick stop and fault reaction, m/s2 (object 6085); the drive's own unless told.
    following_error : float, optional
        Beyond which the drive stops itself, m (object 6065); the drive's own unless told.
    patience : float, optional
        How long the drive goes on without its host, s (object 2010); the drive's own unless told.

    Returns
    -------
    Cia402Table
        Open; a `with` block closes it.

    Raises
    ------
    DeviceTimeout, ObjectRefused, DeviceMismatch
        Where nobody answers, or somebody else does.
    """
    sensor_node = SENSOR_NODE if rotation else None
    table = Cia402Table(
        bus,
        capacity,
        drive_node=DRIVE_NODE,
        sensor_node=sensor_node,
        cycle_time=cycle_time,
        clock=clock,
        idle=idle,
        time_limit=time_limit,
        state_limit=state_limit,
        stop_deceleration=stop_deceleration,
        following_error=following_error,
        patience=patience,
    )
    table.open()
    return table
