"""What every shake table is to the rest of the project: one small abstract class."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from typing import TYPE_CHECKING, ClassVar, Self, final

from devices.errors import DeviceError, DeviceNotReady, SetpointRefused
from devices.setpoints import SetpointLimits

if TYPE_CHECKING:
    from collections.abc import Callable
    from types import TracebackType

    from devices.sample import Description, Sample
    from excitation import Capacity


class ShakeTable(ABC):
    """A table moved by one position set-point a cycle. Contract:

    1. `open` connects and moves nothing; `enable` powers the table where it stands; `exchange` is one cycle;
       `quick_stop` brings it to a standstill and takes the power off, `cut_power` the other way round; `disable` takes
       it off at rest; `close` disconnects, with a quick stop first where the table may still be powered: never enabled
       and confirmed to be off are the only exceptions, so that a stop that failed is tried again. A `with` block opens
       and closes.
    2. Cycle numbers rise; numbers left out are cycles the host missed, and are never made up for.
    3. A set-point beyond the capacity is refused before anything is sent (`devices.setpoints`); none is ever clipped.
    4. Every wait has a time limit. After an error of `exchange` the table is still to be stopped: `quick_stop`.

    The public methods are final and do the checks; a driver fills the underscored ones.

    Parameters
    ----------
    capacity : excitation.Capacity
        What the table can do; its name is the table's name.
    cycle_time : float
        Time between cycles, s.
    resolution : float
        Step of the positions the driver's frames carry, m.
    start_window : float
        Largest distance between the position to be enabled at and the measured one, m.
    """

    follows_setpoints: ClassVar[bool] = True
    """Whether it goes where it is told; a released machine (`devices.released_table`) makes its own motion."""

    def __init__(self, capacity: Capacity, cycle_time: float, resolution: float, start_window: float = 20e-6) -> None:
        self.name = capacity.name
        self.capacity = capacity
        self.cycle_time = cycle_time
        self.resolution = resolution
        self.start_window = start_window
        self._limits = SetpointLimits(capacity, cycle_time, resolution)
        self._opened = False
        self._enabled = False
        self._powered = False
        self._last_cycle: int | None = None

    @property
    def enabled(self) -> bool:
        """Whether the table takes set-points."""
        return self._enabled

    @property
    def powered(self) -> bool:
        """Whether we powered the table, or tried to, and have not seen it at a standstill with the power off since."""
        return self._powered

    @property
    def answer_time(self) -> float:
        """From the last cycle's SYNC to the last of its answers, s; NaN where there is no such thing."""
        return math.nan

    @property
    @abstractmethod
    def position(self) -> float:
        """Last measured position, m: where to `enable`. After a stop that is anywhere inside the stroke."""

    @final
    def open(self) -> None:
        """Connect; nothing moves. Opening an open table does nothing."""
        if not self._opened:
            self._open()
            self._opened = True

    @final
    def describe(self) -> tuple[Description, ...]:
        """Ask every node who it is and what it does; nothing moves.

        Raises
        ------
        DeviceNotReady
            Before `open`, or while the table takes set-points.
        DeviceTimeout, ObjectRefused
            Where a node does not answer.
        """
        self._require_idle(f"{self.name} is to be described")
        return self._describe()

    @final
    def enable(self, position: float) -> None:
        """Power the table where it stands, which must be at `position`, m (0 at the centre of the stroke).

        Raises
        ------
        SetpointRefused
            Where the position is outside the stroke or not where the table stands.
        DriveFault, DeviceTimeout, DeviceNotReady
            Where the table does not come up.
        """
        if not self._opened:
            raise DeviceNotReady(f"{self.name} is enabled before it is open")
        position = self._rounded(position)
        if (beyond := self._limits.outside(position)) is not None:
            raise SetpointRefused(beyond.sentence, beyond.limit)
        self._powered = True
        self._enable(position)
        self._limits.start(-1, position)
        self._last_cycle = None
        self._enabled = True

    @final
    def exchange(self, cycle: int, target_position: float) -> Sample:
        """Do one cycle: send a set-point, and return what was measured as the cycle began.

        Parameters
        ----------
        cycle : int
            Number of the cycle; higher than the last one.
        target_position : float
            Where the table shall be at the end of this cycle, at `(cycle + 1) * cycle_time`, m from the centre.

        Raises
        ------
        SetpointRefused
            Where the set-point is beyond the capacity; nothing was sent.
        DriveFault, DriveStopped, DeviceTimeout, BusFailure
            Where the table did not do it; it is to be stopped.
        """
        if not self._enabled:
            raise DeviceNotReady(f"{self.name} is sent a set-point before it is enabled")
        if self._last_cycle is None:
            self._limits.start(cycle - 1, self._limits.position)
        elif cycle <= self._last_cycle:
            raise ValueError(f"cycle {cycle} follows cycle {self._last_cycle}; cycle numbers must rise")
        target = self._rounded(target_position)
        if (refusal := self._limits.refusal(cycle, target)) is not None:
            raise SetpointRefused(refusal.sentence, refusal.limit)
        self._limits.accept(cycle, target)
        skipped = 1 if self._last_cycle is None else cycle - self._last_cycle
        self._last_cycle = cycle
        return self._exchange(cycle, skipped, target)

    @final
    def quick_stop(self, each: Callable[[Sample], object] | None = None, after: int = -1) -> None:
        """Bring the table to a standstill by the drive's own ramp, then take the power off.

        `each` is called with the sample of every cycle on the way; their numbers continue those of `exchange`, and are
        above `after`, the last cycle the host knows to be gone. Nothing
        but the drive's own answer is needed: rotations are NaN where the specimen's sensor is silent, and cycles
        without an answer are passed over.

        Raises
        ------
        DeviceTimeout
            Where no standstill is confirmed in time: the table may still be moving. It stays `powered`, so that `close`
            or another call tries again.
        """
        self._end(self._quick_stop, each, after)

    @final
    def cut_power(self, each: Callable[[Sample], object] | None = None, after: int = -1) -> None:
        """Take the power off at once; the table runs down by itself, and is waited for.

        For where a ramp is worse than none, also during one. Arguments and errors as for `quick_stop`.
        """
        self._end(self._cut_power, each, after)

    def _end(
        self,
        stop: Callable[[int, Callable[[Sample], object] | None], None],
        each: Callable[[Sample], object] | None,
        after: int,
    ) -> None:
        if not self._opened:
            raise DeviceNotReady(f"{self.name} is stopped before it is open")
        self._enabled = False

        def counted(sample: Sample) -> None:
            # A stop that is taken up again, or made harder, goes on counting.
            self._last_cycle = sample.cycle
            if each is not None:
                each(sample)

        stop(max(after, -1 if self._last_cycle is None else self._last_cycle), counted)
        self._powered = False

    @final
    def disable(self) -> None:
        """Take the power off a table at rest; a table that was told to move is stopped first. Idempotent."""
        if not self._powered:
            return
        if not self._enabled or self._limits.velocity != 0.0:
            self.quick_stop()
            return
        self._enabled = False
        self._disable()
        self._powered = False

    @final
    def close(self) -> None:
        """Disconnect; a table that may still be powered is stopped first. Closing a closed table does nothing."""
        if not self._opened:
            return
        try:
            if self._powered:
                self.quick_stop()
        finally:
            self._opened = False
            self._close()

    def __enter__(self) -> Self:
        self.open()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        try:
            self.close()
        except DeviceError as second:
            if error is None:
                raise
            error.add_note(f"and {self.name} could not be stopped and closed in order: {second}")

    def _require_idle(self, what: str) -> None:
        """Refuse `what` before `open`, and while set-points are taken."""
        if not self._opened or self._enabled:
            raise DeviceNotReady(f"{what} before it is {'stopped' if self._opened else 'open'}")

    def _rounded(self, position: float) -> float:
        steps = position / self.resolution
        if not math.isfinite(steps):
            raise ValueError(f"set-point of {position} m for {self.name}; it must be finite")
        return round(steps) * self.resolution

    @abstractmethod
    def _open(self) -> None:
        """Connect; move nothing."""

    def _describe(self) -> tuple[Description, ...]:
        """Return a description of every node; none where there is nobody to ask."""
        return ()

    @abstractmethod
    def _enable(self, position: float) -> None:
        """Power the table at `position`, m, or raise; refuse where it stands elsewhere."""

    @abstractmethod
    def _exchange(self, cycle: int, steps: int, target_position: float) -> Sample:
        """Do one cycle, `steps` cycles after the one before."""

    @abstractmethod
    def _quick_stop(self, last_cycle: int, each: Callable[[Sample], object] | None) -> None:
        """Stop and power off, whatever fails on the way; return only where both are confirmed.

        Samples are numbered from `last_cycle` + 1.
        """

    @abstractmethod
    def _cut_power(self, last_cycle: int, each: Callable[[Sample], object] | None) -> None:
        """Power off at once, then wait for the standstill; otherwise as `_quick_stop`."""

    @abstractmethod
    def _disable(self) -> None:
        """Power off a table at rest."""

    @abstractmethod
    def _close(self) -> None:
        """Disconnect; must not raise where the connection is already gone."""
