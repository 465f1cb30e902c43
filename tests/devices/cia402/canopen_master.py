"""canopen's own CiA 402 master against our emulated drive: who is not us must be able to drive it.

Its traps, met here: a synchronous RPDO counts as periodic, so that a controlword is never sent before
`rpdo[1].start(period)`; its SYNC producer sends no counter, which our drive needs; a quick stop is not in its table of
transitions and is asked for with the controlword; and it reads PDO mappings only after a heartbeat.
"""

from __future__ import annotations

import threading
from contextlib import contextmanager
from importlib.resources import files
from typing import TYPE_CHECKING

import canopen
from canopen.profiles.p402 import BaseNode402, Homing, State402

from devices.cia301.buses import open_bus
from devices.cia301.frames import SYNC_COUNTS
from devices.cia402.drive import Drive, DriveOptions
from devices.clock import WallClock
from excitation import Capacity
from tests.devices.cia402.rail import Rail
from tests.devices.cia402.traffic import Frame

if TYPE_CHECKING:
    from collections.abc import Iterator

H = 2e-3
NM = 1e-9
CAPACITY = Capacity(name="bench", stroke=0.2, velocity=0.5, acceleration=10.0, provenance={})
# Threads of a busy machine stall; what is proved here is the protocol, not the timing.
OPTIONS = DriveOptions(patience=200, stop_deceleration=2.0)
HOMING_BITS, NOT_STARTED = Homing.STATES["INTERRUPTED"]
STEP = 30e-6
"""m; from rest in one cycle and to rest in the next, 7.5 m/s2."""


def make_drive(send, position: float = 0.0) -> Drive:
    """Return the drive that is proved, the same for every recording."""
    return Drive(1, send, Rail(position, cycle_time=H), CAPACITY, H, position=position, options=OPTIONS)


class Bench:
    """The drive in a thread that also produces SYNC, and canopen's node with the Notifier thread of its network."""

    def __init__(self, channel: str, position: float) -> None:
        self.frames: list[Frame] = []
        self.bus = open_bus("virtual", channel)
        self.bus.tap = lambda *frame: self.frames.append(Frame(*frame))
        self.drive = make_drive(self.bus.send, position)
        self.rail: Rail = self.drive.axis.machine
        self.network = canopen.Network()
        self._end = threading.Event()
        self._sync = open_bus("virtual", channel)
        self._thread = threading.Thread(target=self._serve, daemon=True)

    def _serve(self) -> None:
        clock = WallClock()
        self.drive.boot()
        due, counter = clock.now(), 0
        while not self._end.is_set():
            if clock.now() >= due:
                counter = counter % SYNC_COUNTS + 1
                self._sync.send(0x080, bytes([counter]))
                due = max(due + H, clock.now())
            frame = self.bus.receive(max(0.0, due - clock.now()))
            if frame is not None:
                self.drive.receive(*frame)
            self.drive.node.beat(clock.now())

    def start(self, channel: str) -> BaseNode402:
        """Return canopen's node, its network connected and its PDOs known."""
        self.network.connect(interface="virtual", channel=channel)
        node = BaseNode402(1, str(files("devices.cia402").joinpath("servo_drive.eds")))
        self.network.add_node(node)
        self._thread.start()
        node.nmt.wait_for_heartbeat(5.0)
        node.setup_402_state_machine()
        node.nmt.state = "OPERATIONAL"
        return node

    def close(self) -> None:
        """End both."""
        self._end.set()
        self._thread.join(5.0)
        self.network.disconnect()
        self.bus.close()
        self._sync.close()


@contextmanager
def bench(channel: str, position: float = 0.0) -> Iterator[tuple[Bench, BaseNode402]]:
    """A drive that is served, and canopen's node of it."""
    rig = Bench(channel, position)
    try:
        yield rig, rig.start(channel)
    finally:
        rig.close()


def wait_for(node: BaseNode402, state: str, receptions: int = 3000) -> None:
    """Wait for a state, told by TPDOs; each wait for one has its own limit."""
    for _ in range(receptions):
        if node.state == state:
            return
        node.check_statusword(2.0)
    raise TimeoutError(f"{node.state} instead of {state}")


def enable(node: BaseNode402) -> None:
    """Switch the drive on where it stands."""
    node.check_statusword(2.0)
    node.rpdo[1]["Target position"].raw = node.tpdo[1]["Position actual value"].raw
    node.rpdo[1].start(H)
    node.state = "OPERATION ENABLED"


def move(node: BaseNode402, steps: int) -> int:
    """Move by so many small steps, each seen to be answered; return the last target, nm."""
    target = node.tpdo[1]["Position actual value"].raw
    for _ in range(steps):
        target += round(STEP / NM)
        node.rpdo[1]["Target position"].raw = target
        for _ in range(1000):
            node.tpdo[1].wait_for_reception(2.0)
            if node.tpdo[1]["Position actual value"].raw == target:
                break
    return target


def home(node: BaseNode402, method: int) -> bool:
    """Home with canopen's own procedure; started before, for it takes a start that is not seen yet for a failure."""
    node.check_statusword(2.0)
    node.rpdo[1]["Target position"].raw = node.tpdo[1]["Position actual value"].raw
    node.rpdo[1].start(H)
    node.sdo[0x6098].raw = method
    node.op_mode = "HOMING"
    node.state = "OPERATION ENABLED"
    node.controlword = State402.CW_OPERATION_ENABLED | Homing.CW_START
    for _ in range(3000):
        if node.check_statusword(2.0) & HOMING_BITS != NOT_STARTED:
            break
    return node.homing(timeout=20)


def session(rig: Bench, node: BaseNode402) -> None:
    """Enable, move, quick-stop, provoke a fault and reset it, each step seen to be done."""
    enable(node)
    assert node.state == "OPERATION ENABLED"
    assert move(node, 60) == node.tpdo[1]["Position actual value"].raw == round(rig.rail.position / NM)
    node.controlword = State402.CW_QUICK_STOP
    wait_for(node, "SWITCH ON DISABLED")
    enable(node)
    node.rpdo[1]["Target position"].raw = 90_000_000
    wait_for(node, "FAULT")
    assert node.sdo[0x603F].raw in (0x8400, 0x8500)
    node.rpdo[1]["Target position"].raw = node.tpdo[1]["Position actual value"].raw
    node.reset_from_fault()
    assert node.state == "OPERATION ENABLED"
    node.state = "SWITCH ON DISABLED"
