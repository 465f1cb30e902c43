"""Puts the faults of one run where they act: into an emulator, into its host, or both where they share a process."""

from __future__ import annotations

import math
import os
import signal
from typing import TYPE_CHECKING, Any

from devices.errors import FaultRefused
from devices.faults.catalogue import FAULTS
from devices.faults.foreign import NAMES as FOREIGN
from devices.faults.foreign import ForeignMaster
from devices.faults.host import StallingClock, with_jump
from devices.faults.host_bus import HostBus
from devices.faults.mechanics import FaultyMachine
from devices.faults.node_bus import NodeBus
from devices.faults.schedule import Schedule
from devices.faults.sensors import FaultyAccelerometer, FaultyEncoder

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    import numpy as np

    from devices.cia301.buses import CanBus
    from devices.clock import Clock
    from devices.emulation import Emulation
    from devices.faults.fault import Fault

_COMMUNICATION_ERROR = 0x11
_BUS_OFF = 0x8140
FIRST_OF_A_RUN = 2
"""The SYNC, of those that find a machine powered, with which its host begins: the one before told him that it is."""
NEEDS_A_DRIVE = ("bus_off", "following_error", "limit_switch", "drive_fault", "emergency_stop")


class Injector:
    """The faults of one run.

    An emulator gets its bus from `node_bus` and is handed to `take_over`; a host gets its bus from `host_bus`, its
    clock from `clock`, its set-points from `set_points`, and asks `stopped` every cycle.

    Parameters
    ----------
    faults : sequence of Fault
    clock : Clock
        The one the run goes by.
    cycle_time : float
        s.
    rng : numpy.random.Generator
        Chooses frames and bits: equal seeds, equal faults.
    drive_node : int
        CANopen node that moves the table.
    kill : callable, optional
        Ends this process as `kill -9` does.
    """

    def __init__(
        self,
        faults: Sequence[Fault],
        clock: Clock,
        cycle_time: float,
        rng: np.random.Generator,
        *,
        drive_node: int = 1,
        kill: Callable[[], None] | None = None,
    ) -> None:
        self.schedule = Schedule(faults, clock, cycle_time)
        self._rng = rng
        self._drive_node = drive_node
        self._kill = kill or kill_this_process
        self._begins: dict[str, Callable[[Fault], object]] = {}
        self._each: list[Callable[[], None]] = [self.schedule.look]
        self._looked = (math.nan, False)
        self._powered_syncs = 0

    def when(self, name: str, action: Callable[[Fault], object]) -> None:
        """Do something of the caller's as a fault of that name begins."""
        self._begins[name] = action

    def node_bus(self, bus: CanBus) -> CanBus:
        """Return the bus as the emulator's nodes are to meet it."""
        self._node_bus = NodeBus(bus, self.schedule, self._rng, self._drive_node, self.poll)
        self._each.append(self._node_bus.look)
        return self._node_bus

    def take_over(self, emulation: Emulation, *, host_here: bool) -> None:
        """Put faults into an emulated machine; `host_here` where its host shares its thread.

        Such a machine then lives by a clock of its own as soon as its host is not heard, as in a process of its own;
        and where its process is to be killed, it falls silent and stands still in time instead. Where the host is not
        here the table's clock begins with the second SYNC that finds the machine powered: the first one tells the host
        so, with the second one it begins its run.

        Raises
        ------
        FaultRefused
            Where the machine has no such part.
        """
        plant: Any = getattr(emulation, "plant", None)
        drive: Any = getattr(emulation, "drive", None)
        self._replace(plant, "encoder", FaultyEncoder)
        self._replace(plant, "accelerometer", FaultyAccelerometer)
        if drive is None:
            self._refuse(NEEDS_A_DRIVE, "a servo drive")
        else:
            drive.axis.couple(FaultyMachine(drive.axis.machine, self.schedule))
            self.when("drive_fault", lambda fault: drive.fail(int(fault.magnitude)))
            self.when("bus_off", lambda _: drive.fail(_BUS_OFF, _COMMUNICATION_ERROR))
            # What it says while it is off the bus nobody hears.
            self._node_bus.recovered = lambda: drive.node.emergency(_BUS_OFF, _COMMUNICATION_ERROR)
        self._each.append(emulation.live_alone)
        if host_here:
            self.when("emulator_killed", lambda _: self._fall_silent())
        else:
            self._node_bus.synced = lambda: self._begin_with(emulation)
            self.when("emulator_killed", lambda _: self._kill())

    def host_bus(self, bus: CanBus, another: Callable[[], CanBus]) -> CanBus:
        """Return the bus as the host is to meet it; `another` opens one more end of it, where somebody else sends."""
        master: ForeignMaster | None = None
        if self.schedule.has(*FOREIGN):
            master = ForeignMaster(another(), self.schedule, self._drive_node)
        return HostBus(bus, self.schedule, master, self.poll)

    @property
    def clock(self) -> Clock:
        """The clock the live loop is to go by."""
        return StallingClock(self.schedule, self.poll, self._kill)

    def set_points(self, planned: Sequence[float]) -> list[float]:
        """Return the planned set-points, m, with the jumps of setpoint_in_exchange."""
        return with_jump(planned, self.schedule.faults, self.schedule.cycle_time)

    def stopped(self) -> str | None:
        """Return the operator's reason to stop, if he has one by now."""
        return None if self.schedule.due("operator_stop") is None else "operator: stop was asked (injected)"

    def poll(self) -> None:
        """Let what is due begin, and what is not the host live on."""
        # A waiting host services its emulator many times in one instant of a manual clock.
        looked = self.schedule.clock.now(), self.schedule.running
        if looked == self._looked:
            return
        self._looked = looked
        for name, action in self._begins.items():
            if (fault := self.schedule.due(name)) is not None:
                action(fault)
        for each in self._each:
            each()

    def _replace(self, plant: Any, part: str, faulty: type[FaultyEncoder | FaultyAccelerometer]) -> None:
        if hasattr(plant, part):
            setattr(plant, part, faulty(getattr(plant, part), self.schedule))
        else:
            self._refuse([name for name in FAULTS if name.startswith(part)], f"an {part}")

    def _refuse(self, names: Sequence[str], part: str) -> None:
        for fault in self.schedule.faults:
            if fault.name in names:
                raise FaultRefused(f"fault {fault.name} needs {part}; this machine has none")

    def _begin_with(self, emulation: Emulation) -> None:
        self._powered_syncs += emulation.powered
        if self._powered_syncs == FIRST_OF_A_RUN:
            self.schedule.start()

    def _fall_silent(self) -> None:
        self._node_bus.gone = True
        self._each.clear()


def kill_this_process() -> None:
    """End this process without any last word; Windows' way of it is TerminateProcess."""
    os.kill(os.getpid(), getattr(signal, "SIGKILL", signal.SIGTERM))
