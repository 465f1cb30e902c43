"""What every emulated machine shares: nodes on a bus, a loop that answers frames, and a watchdog of its own."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import TYPE_CHECKING, Protocol

from devices.cia301.frames import SYNC
from devices.clock import WallClock
from devices.errors import BusFailure

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from devices.cia301.buses import CanBus
    from devices.cia301.node import Device
    from devices.clock import Clock

_FRAMES_AT_ONCE = 1000


class StopSignal(Protocol):
    """A `threading.Event` or `multiprocessing.Event`."""

    def is_set(self) -> bool: ...


class Stand(Protocol):
    """What of a plant the specimen stands on.

    Attributes
    ----------
    released : bool
        Whether the specimen moves; while False it is held at its rotation.
    rotation : float
        Of the specimen, rad.
    """

    released: bool
    rotation: float


class Emulation(ABC):
    """A machine that is not there: its nodes on a bus.

    A subclass calls `super().__init__` first, builds its plant and its devices, which send through `self.send`, hands
    both to `attach`, and fills `powered`, `at_ease`, `patience` and `elapse`.

    The specimen is held as it is until the machine is first powered, so that one released from a tilt does not fall
    while the host brings the machine up. Each time the power comes on again it is set up anew, as an operator would
    between two runs.

    In one process with the host give `service` to the host as its `idle`: the bus clock is then the SYNC counter, and
    nothing happens between SYNCs. In a process of its own call `serve`: a machine that hears no SYNC then lives by its
    own clock. Frames and code are the same.

    Parameters
    ----------
    bus : CanBus
        Open bus; it stays open.
    cycle_time : float
        Time between two SYNCs, s.
    clock : Clock, optional
        Of heartbeats and, in `serve`, of the SYNC watchdog; the wall clock unless told.
    set_up : callable, optional
        Called as the power comes on: puts the specimen back to `initial_rotation`. Without it the specimen stays as the
        last run left it.
    initial_rotation : float
        Of the specimen, rad.

    Attributes
    ----------
    devices : sequence of Device
        In the order in which they hear each frame: the one that moves the specimen first, its sensors after it.
    unsent : int
        Frames the bus did not take; the machine goes on without them, as a real one would.
    """

    def __init__(
        self,
        bus: CanBus,
        *,
        cycle_time: float,
        clock: Clock | None = None,
        set_up: Callable[[], None] | None = None,
        initial_rotation: float = 0.0,
    ) -> None:
        self._cycle_time = cycle_time
        self.devices: Sequence[Device] = ()
        self.unsent = 0
        self._bus = bus
        self._clock = clock or WallClock()
        self._set_up = set_up
        self._initial_rotation = initial_rotation
        self._stand: Stand | None = None
        self._on = False
        self._booted = False
        self._synced = self._clock.now()
        self._lived = 0

    @property
    def cycle_time(self) -> float:
        """Time between two SYNCs, s; a machine whose host can set it (object 1006) tells what holds now."""
        return self._cycle_time

    @property
    @abstractmethod
    def powered(self) -> bool:
        """Whether the machine may move; the specimen is let go the moment this becomes true."""

    @property
    @abstractmethod
    def at_ease(self) -> bool:
        """Whether nothing moves and nothing will without a new command."""

    @abstractmethod
    def patience(self, idle_cycles: int) -> int:
        """Return how many cycles without SYNC are waited for; `idle_cycles` where nothing is at stake."""

    @abstractmethod
    def elapse(self, cycles: int) -> None:
        """Live through `cycles` without SYNC, told by the machine's own clock."""

    def attach(self, stand: Stand | None, devices: Sequence[Device]) -> None:
        """Put the devices on the bus, and say where the specimen stands; None where there is none."""
        self.devices = tuple(devices)
        self._stand = stand
        if stand is not None:
            stand.released = False

    def send(self, identifier: int, data: bytes) -> None:
        """Send one frame of a node; one that the bus does not take is lost and counted."""
        try:
            self._bus.send(identifier, data)
        except BusFailure:
            self.unsent += 1

    def boot(self) -> None:
        """Power on; done by the first `service` or `serve` where it was not done before."""
        if not self._booted:
            self._booted = True
            for device in self.devices:
                device.boot()

    def service(self) -> None:
        """Answer every frame that waits, and return; never blocks."""
        self.boot()
        for _ in range(_FRAMES_AT_ONCE):
            if (frame := self._bus.receive()) is None:
                break
            self._take(*frame)
        self._beat()

    def serve(self, stop: StopSignal, *, idle_limit: float = 5.0) -> None:
        """Answer frames until `stop` is set; then bring the machine to rest, within `idle_limit`, s, and return.

        Without SYNC the machine waits `patience` cycles of this process's clock, `idle_limit` at most, and then lives
        by it.
        """
        self.boot()
        self._synced = self._clock.now()
        while not stop.is_set():
            if (frame := self._bus.receive(self.cycle_time)) is not None:
                self._take(*frame)
            self._beat()
            self.live_alone(idle_limit)
        for _ in range(int(idle_limit / self.cycle_time)):
            if self.at_ease:
                break
            self.elapse(1)

    def live_alone(self, idle_limit: float = 5.0) -> None:
        """Live by the own clock where SYNC has not come for longer than `patience`, or `idle_limit`, s, at most."""
        silent = int((self._clock.now() - self._synced) / self.cycle_time)
        if silent > self.patience(int(idle_limit / self.cycle_time)) and not self.at_ease:
            self.elapse(silent - self._lived)
            self._lived = silent

    def _take(self, identifier: int, data: bytes) -> None:
        """Hand a frame to the devices."""
        for device in self.devices:
            device.receive(identifier, data)
            if self.powered is not self._on:
                self._switch()
        if identifier == SYNC:
            self._synced, self._lived = self._clock.now(), 0

    def _switch(self) -> None:
        self._on = not self._on
        if self._on and self._stand is not None:
            self._stand.released = True
            if self._set_up is not None:
                self._set_up()
                self._stand.rotation = self._initial_rotation

    def _beat(self) -> None:
        now = self._clock.now()
        for device in self.devices:
            device.node.beat(now)
