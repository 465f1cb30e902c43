"""What the host checks and sets in a servo drive before it is enabled; in the cycle none of this is touched."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

from devices.cia301.commissioning import check_identity, check_objects, check_pdos, describe_node, set_heartbeats
from devices.cia301.dictionary import ObjectStore
from devices.cia301.frames import RPDO1, TPDO1, TPDO2
from devices.cia301.sdo_client import Sdo
from devices.cia402.states import CYCLIC_SYNCHRONOUS_POSITION, MODES
from devices.cia402.units import units_of
from devices.errors import DeviceMismatch, EdsError, FrameError

if TYPE_CHECKING:
    from devices.cia301.host import Host
    from devices.cia402.states import State
    from devices.cia402.units import Units
    from devices.sample import Description
    from excitation import Capacity

_CSP_BIT = 1 << 7
_SYNC_OBJECTS, _UNIT_OBJECTS = (0x1005, 0x1019), (0x60A8, 0x60A9, 0x60AA)
_QUICK_STOP_RAMP = 2
_LARGEST = 0xFFFFFFFF

_COMMUNICATION, _COB_ID, _ALL, _LENGTH = (0x1400, 0x1800, 0x1801), 1, 0xFFFFFFFF, 0xFF
# Object, sub-index, the bits that count, and what they must be; what TPDO2 carries is any maker's, in 32 bits.
_LAYOUT = (
    (0x1400, _COB_ID, 0x1FFFFFFF, RPDO1),
    (0x1600, 0, _ALL, 2),
    (0x1600, 1, _ALL, 0x60400010),
    (0x1600, 2, _ALL, 0x607A0020),
    (0x1800, _COB_ID, 0x1FFFFFFF, TPDO1),
    (0x1A00, 0, _ALL, 2),
    (0x1A00, 1, _ALL, 0x60410010),
    (0x1A00, 2, _ALL, 0x60640020),
    (0x1801, _COB_ID, 0x1FFFFFFF, TPDO2),
    (0x1A01, 0, _ALL, 1),
    (0x1A01, 1, _LENGTH, 0x20),
)


class Setup(NamedTuple):
    """How a drive is to be set up.

    Attributes
    ----------
    capacity : excitation.Capacity
        Becomes 607D, 607F and 60C5.
    cycle_time : float
        s, becomes 1006.
    stop_deceleration, following_error : float or None
        m/s2 and m, become 6085 and 6065; None leaves what the drive has.
    patience : float or None
        s, becomes the whole cycles of 2010; None leaves what the drive has.
    eds, sensor_eds : str
        Texts of the electronic data sheets.
    """

    capacity: Capacity
    cycle_time: float
    stop_deceleration: float | None
    following_error: float | None
    patience: float | None
    eds: str
    sensor_eds: str


class Commissioning:
    """A table's nodes before and after its cycles: the first node of the link is the drive, the second its sensor.

    Parameters
    ----------
    link : Host
    name : str
        Of the table.
    setup : Setup
    tries : int
        How often a lost answer is asked for again.
    """

    def __init__(self, link: Host, name: str, setup: Setup, tries: int) -> None:
        self.drive = Sdo(link, link.nodes[0], setup.eds, name, tries=tries)
        self.units = units_of(setup.eds)
        self._sensors = [Sdo(link, node, setup.sensor_eds, name, tries=tries) for node in link.nodes[1:]]
        self._link = link
        self._setup = setup

    def check(self) -> None:
        """Make sure that the nodes are those of their electronic data sheets; errors as of `check_drive`."""
        # A node that was stopped answers no SDO before it is told to start; one that runs is not disturbed by it.
        self._link.start()
        check_drive(self.drive, self._setup.eds)
        for sensor in self._sensors:
            check_identity(sensor, self._setup.sensor_eds)
            check_pdos(sensor, self._setup.sensor_eds)

    def set_up(self) -> None:
        """Write everything that is to be set, and start the nodes; nothing moves. Errors as of `set_up_drive`."""
        set_up_drive(self.drive, self._setup, self.units, self._link.node)
        for sensor in self._sensors:
            set_heartbeats(sensor, self._link.node)
        for node in self._link.nodes:
            self._link.watch(node)
        self._link.start()
        self._link.drain()
        self._link.restarted = None

    def describe(self, state: State | None) -> tuple[Description, ...]:
        """Ask the nodes who they are; `state` is the drive's by its last statusword."""
        mode = self.drive.read(0x6061)
        name = MODES.get(mode, f"mode {mode}")
        drive = describe_node(self.drive, "servo drive", state=str(state or "unknown"), mode=name)
        return drive, *(describe_node(sensor, "rotation sensor", state="operational") for sensor in self._sensors)


def cycle_microseconds(cycle_time: float) -> int:
    """Return a cycle time, s, as object 1006 tells it.

    Raises
    ------
    FrameError
        Where it is no whole number of microseconds.

    Examples
    --------
    >>> cycle_microseconds(1.0 / 800.0)
    1250
    """
    microseconds = round(1e6 * cycle_time)
    if not math.isclose(1e6 * cycle_time, microseconds, rel_tol=1e-9):
        raise FrameError(f"cycle time is {1e6 * cycle_time:.6g} us; a drive takes whole microseconds (object 1006)")
    return microseconds


def check_layout(eds: str, node: int) -> None:
    """Make sure that an electronic data sheet maps into PDOs what the cycle's frames carry (`devices.cia402.frames`).

    Raises
    ------
    EdsError
        Where it maps something else, elsewhere, or nothing.
    """
    objects = ObjectStore(eds, node)
    for index, sub, mask, wanted in _LAYOUT:
        try:
            found = objects.get(index, sub)
        except KeyError:
            raise EdsError(f"EDS declares no object {index:04X}:{sub:02X}, which is needed in the cycle") from None
        wanted += node if sub == _COB_ID and index in _COMMUNICATION else 0
        if found & mask != wanted:
            raise EdsError(f"EDS has {found:X} in object {index:04X}:{sub:02X}; the cycle needs {wanted:X}")


def check_drive(sdo: Sdo, eds: str) -> None:
    """Make sure that the drive is the one of the electronic data sheet and can do what is asked of it.

    Raises
    ------
    EdsError
        Where the data sheet is of no use here.
    DeviceMismatch
        Where it is another one, its PDOs carry something else, its units are others or it has no such mode.
    ObjectRefused, DeviceTimeout
        Where it does not answer.
    """
    check_layout(eds, sdo.node)
    check_identity(sdo, eds)
    check_objects(sdo, eds, *_SYNC_OBJECTS, *_UNIT_OBJECTS)
    check_pdos(sdo, eds)
    if not sdo.read(0x6502) & _CSP_BIT:
        raise DeviceMismatch(
            f"node {sdo.node} of {sdo.name} has no cyclic synchronous position mode (object 6502, bit 7)"
        )


def set_up_drive(sdo: Sdo, setup: Setup, units: Units, host_node: int) -> None:
    """Write limits, ramps, watchdogs, heartbeats and mode; nothing moves.

    Raises
    ------
    ObjectRefused
        Where the drive does not take a number.
    DeviceMismatch
        Where it does not go into the mode.
    """
    capacity = setup.capacity
    half = math.floor(0.5 * capacity.stroke / units.position + 0.5)
    sdo.write(0x1006, cycle_microseconds(setup.cycle_time))
    sdo.write(0x607D, -half, 1)
    sdo.write(0x607D, half, 2)
    # Upwards: rounding must not refuse what the capacity allows.
    sdo.write(0x607F, _at_most(math.ceil(capacity.velocity / units.velocity)))
    sdo.write(0x60C5, _at_most(math.ceil(capacity.acceleration / units.acceleration)))
    if setup.stop_deceleration is not None:
        sdo.write(0x6085, _at_most(max(1, round(setup.stop_deceleration / units.acceleration))))
    if setup.following_error is not None:
        sdo.write(0x6065, _at_most(round(setup.following_error / units.position)))
    if setup.patience is not None:
        sdo.write(0x2010, round(setup.patience / setup.cycle_time))
    sdo.write(0x605A, _QUICK_STOP_RAMP)
    sdo.write(0x605E, _QUICK_STOP_RAMP)
    set_heartbeats(sdo, host_node)
    set_mode(sdo, CYCLIC_SYNCHRONOUS_POSITION)


def set_mode(sdo: Sdo, mode: int) -> None:
    """Set the mode of operation, and see that it is taken; `DeviceMismatch` where it is not."""
    sdo.write(0x6060, mode)
    if (shown := sdo.read(0x6061)) != mode:
        raise DeviceMismatch(f"node {sdo.node} of {sdo.name} stays in mode {shown}; mode {mode} was asked for (6060)")


def _at_most(counts: int) -> int:
    return min(counts, _LARGEST)
