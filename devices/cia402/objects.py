"""Which objects of a drive's dictionary are alive: what is read from the drive now, and what a write makes it do."""

from __future__ import annotations

from typing import TYPE_CHECKING

from devices.cia301.dictionary import WRONG_STATE, WRONG_VALUE, Refused
from devices.cia402 import states
from devices.cia402.homing import DIRECTIONS, METHODS
from devices.cia402.parameters import OPTION_CODES
from devices.cia402.states import State

if TYPE_CHECKING:
    from devices.cia402.drive import Drive


def declare(drive: Drive) -> None:
    """Connect the drive with its object dictionary. A controlword written by SDO is obeyed at the next SYNC too."""
    objects, unit = drive.node.objects, drive.units.position
    objects.on_read(0x603F, lambda: drive.error)
    objects.on_read(0x6040, lambda: drive.command[0])
    objects.on_read(0x6041, lambda: drive.statusword)
    objects.on_read(0x6061, lambda: drive.mode)
    objects.on_read(0x6064, lambda: round(drive.axis.measured / unit))
    objects.on_read(0x607A, lambda: drive.command[1])
    objects.on_read(0x60F4, lambda: round((drive.interpolator.position - drive.axis.measured) / unit))
    objects.on_read(0x60FD, lambda: _inputs(drive))
    objects.on_read(0x2100, lambda: drive.acceleration)
    objects.on_write(0x1006, lambda value: _pace(drive, value))
    objects.on_write(0x6040, lambda value: drive.ask(value, drive.command[1]))
    objects.on_write(0x607A, lambda value: drive.aim(value))
    objects.on_write(0x6060, lambda value: _set_mode(drive, value))
    objects.on_write(0x607C, lambda value: _check(abs(value) * unit <= drive.axis.stroke))
    objects.on_write(0x6098, lambda value: _check_method(drive, value))
    for index, codes in OPTION_CODES.items():
        objects.on_write(index, lambda value, codes=codes: _check(value in codes))


def _check(holds: bool) -> None:
    if not holds:
        raise Refused(WRONG_VALUE)


def _check_method(drive: Drive, method: int) -> None:
    _check(method == 0 or method in METHODS)
    _check(method not in DIRECTIONS or drive.axis.has_switches)


def _set_mode(drive: Drive, mode: int) -> None:
    _check(mode in (states.CYCLIC_SYNCHRONOUS_POSITION, states.HOMING))
    if mode != drive.mode:
        if drive.axis.moving:
            raise Refused(WRONG_STATE)
        drive.set_mode(mode)


def _pace(drive: Drive, microseconds: int) -> None:
    cycle_time = 1e-6 * microseconds
    if abs(cycle_time - drive.interpolator.limits.cycle_time) < 0.5e-6:
        return
    if drive.state is State.OPERATION_ENABLED or drive.axis.moving:
        raise Refused(WRONG_STATE)
    _check(drive.axis.pace(cycle_time))


def _inputs(drive: Drive) -> int:
    s = drive.axis.switches
    return s.negative | s.positive << 1 | s.home << 2 | s.stop << 16
