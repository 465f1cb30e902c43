"""The ST-III over Quanser's HIL API, for a host that closes the position loop itself."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from devices.quanser_st3.capacity import CAPACITY
from devices.quanser_st3.hil_card import quanser_hardware
from devices.quanser_st3.hil_settings import load_settings
from devices.quanser_st3.hil_table import HilTable

if TYPE_CHECKING:
    from collections.abc import Mapping

    from devices.clock import Clock
    from excitation import Capacity


def check(table: Mapping[str, object]) -> None:
    """Tell whether such a table could be opened here; nothing is opened.

    Raises
    ------
    BusUnavailable, ValueError
        As `open_table`.
    """
    quanser_hardware()
    load_settings(table)


def open_table(
    table: Mapping[str, object],
    *,
    capacity: Capacity = CAPACITY,
    cycle_time: float = 1e-3,
    clock: Clock | None = None,
    rotation: bool = True,
    state_limit: float = 3.0,
    stop_deceleration: float = 1.0,
    following_error: float = 20e-3,
    hardware: Any = None,
) -> HilTable:
    """Connect to an ST-III on a Quanser board; nothing moves.

    Parameters
    ----------
    table : mapping
        `[hil]` of the capacity file: `devices.quanser_st3.hil_settings`.
    capacity : excitation.Capacity
        Of your table; the default numbers are placeholders.
    cycle_time : float
        s.
    clock : Clock, optional
        The computer's; the wall clock unless told. Cycles are paced by the table's own `clock`.
    rotation : bool
        Whether there is an encoder on the specimen.
    state_limit, stop_deceleration, following_error : float
        As for `HilTable`.
    hardware : module, optional
        Stands in for `quanser.hardware`.

    Returns
    -------
    HilTable
        Open; a `with` block closes it.

    Raises
    ------
    BusUnavailable
        Where Quanser's software, the board or what must be said of it are missing.
    LoopUnstable
        Where the cycle is too slow for the position loop.
    """
    module = quanser_hardware() if hardware is None else hardware
    made = HilTable(
        capacity,
        load_settings(table),
        module,
        cycle_time=cycle_time,
        wall=clock,
        stop_deceleration=stop_deceleration,
        following_error=following_error,
        state_limit=state_limit,
        rotation=rotation,
    )
    made.open()
    return made
