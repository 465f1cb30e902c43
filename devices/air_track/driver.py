"""The air track on any CAN bus: a release device (CiA 401) and its sensors (CiA 404 and 406)."""

from __future__ import annotations

from typing import TYPE_CHECKING

from devices.air_track.capacity import CAPACITY
from devices.released_driver import open_released

if TYPE_CHECKING:
    from collections.abc import Callable

    from devices.cia301.buses import CanBus
    from devices.clock import Clock
    from devices.released_table import ReleasedTable
    from excitation import Capacity


def open_table(
    bus: CanBus,
    *,
    capacity: Capacity = CAPACITY,
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
    """Connect to an air track; nothing moves.

    Parameters
    ----------
    bus : CanBus
        Open bus; it stays open when the table is closed.
    capacity : excitation.Capacity
        Of your machine; the default numbers are placeholders.
    cycle_time : float
        s.
    clock : Clock, optional
        The wall clock unless told.
    idle : callable, optional
        `EmulatedAirTrack.service` of an emulator in this process; nothing for a real machine or another process.
    rotation : bool
        Whether a rotation sensor answers, as node 4.
    beams : float, optional
        Distance between the two displacement sensors that stand for it, m; an encoder unless told.
    inclinometer : bool
        Whether there is one on the block, as node 5.
    time_limit : float
        For all answers to one SYNC, s.
    state_limit : float
        For arming, or for a stop, s; longer than the cart takes to come to rest.
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
    return open_released(
        bus,
        capacity,
        air=True,
        cycle_time=cycle_time,
        clock=clock,
        idle=idle,
        rotation=rotation,
        beams=beams,
        inclinometer=inclinometer,
        time_limit=time_limit,
        state_limit=state_limit,
    )
