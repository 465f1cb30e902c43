"""Homing, from the host's side: let the drive look for a limit switch and take it as the origin of its positions."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from devices.cia402 import states
from devices.cia402.commissioning import set_mode
from devices.cia402.states import State, decode, next_controlword
from devices.errors import DeviceTimeout, DriveFault

if TYPE_CHECKING:
    from devices.cia402.master import Cia402Table

NEGATIVE_SWITCH, POSITIVE_SWITCH, WHERE_IT_STANDS = 17, 18, 37
"""Methods (object 6098)."""

_DONE = states.HOMING_ATTAINED | states.TARGET_REACHED


def home(
    table: Cia402Table,
    method: int,
    *,
    offset: float = 0.0,
    fast: float = 0.02,
    slow: float = 0.002,
    acceleration: float = 0.5,
    time_limit: float = 60.0,
) -> None:
    """Home an open table, powered off; it is powered off again after it, and `table.position` is the new one.

    Parameters
    ----------
    table : Cia402Table
    method : int
        17 and 18 go to the negative or positive limit switch, 37 takes the place where the table stands.
    offset : float
        Zero position less home position, m (607C): minus where the switch's edge is to be found later.
    fast, slow : float
        Speeds to the switch and back from it, m/s (6099).
    acceleration : float
        m/s2 (609A). Whatever stands on the table is moved with it: keep it under half of g tan(alpha).
    time_limit : float
        s.

    Raises
    ------
    DriveFault
        Where the drive finds no switch, or goes into fault.
    DeviceTimeout
        Where it is not done in time, or a drive that is asked to start does not.
    DeviceNotReady
        Before `open`, or while the table takes set-points.
    ObjectRefused
        Where it does not take a number, or has no switches.
    """
    # Refused while the table takes set-points: nothing below may touch it then.
    table.steer(states.DISABLE_VOLTAGE)
    sdo, units = table.objects, table.units
    sdo.write(0x6098, method)
    sdo.write(0x607C, round(offset / units.position))
    for sub, speed in ((1, fast), (2, slow)):
        sdo.write(0x6099, max(1, round(speed / units.velocity)), sub)
    sdo.write(0x609A, max(1, round(acceleration / units.acceleration)))
    set_mode(sdo, states.HOMING)
    try:
        _run(table, math.ceil(time_limit / table.cycle_time))
    finally:
        # Whatever happened, the power goes off and the mode is the one of every other run.
        table.quick_stop()
        set_mode(sdo, states.CYCLIC_SYNCHRONOUS_POSITION)


def _run(table: Cia402Table, cycles: int) -> None:
    word, asked = table.steer(states.DISABLE_VOLTAGE), 0
    for _ in range(cycles):
        state = decode(word)
        # The answer to the cycle in which the start bit rises was latched before it.
        if state in (State.FAULT, State.FAULT_REACTION_ACTIVE) or (asked > 1 and word & states.HOMING_ERROR):
            raise DriveFault(f"homing of {table.name} failed: it is in {state}, and found no switch it could stop at")
        if asked > 1 and word & _DONE == _DONE:
            return
        if state is State.OPERATION_ENABLED:
            asked += 1
            word = table.steer(states.ENABLE_OPERATION | states.HOMING_START)
        else:
            word = table.steer(next_controlword(state))
    raise DeviceTimeout(f"homing of {table.name} is not done after {cycles * table.cycle_time:g} s")
