"""The host's side of a machine that is set by hand and released: arm it, let it go in its cycle, wait for rest."""

from __future__ import annotations

import math
from collections import deque
from typing import TYPE_CHECKING, ClassVar

from devices.cia301 import frames
from devices.cia301.host import HEARTBEAT_LIMIT
from devices.cia401.link import Feedback, ReleaseLink
from devices.cia401.nodes import SDO_LIMIT, ReleasedNodes
from devices.cia401.release import Input, Output
from devices.clock import WallClock
from devices.errors import BusDisturbed, DeviceError, DeviceNotReady, DeviceTimeout, DriveStopped, SetpointRefused
from devices.sample import Description, Sample
from devices.setpoints import Refusal, SetpointLimits
from devices.table import ShakeTable

if TYPE_CHECKING:
    from collections.abc import Callable

    from devices.cia301.buses import CanBus
    from devices.cia301.host import FrameCounts
    from devices.clock import Clock
    from devices.sensors.reading import SensorReading
    from excitation import Capacity

_RESOLUTION = 1e-9
# The base is at rest where it stays within the distance, m, for the time, s: under 0.1 mm/s.
_REST_DISTANCE, _REST_TIME = 1e-5, 0.1
# A base that has not left its latch by then after its release will not, s.
_LATCH_LIMIT = 0.25


class _Expected(SetpointLimits):
    """Set-points that are expected, not sent: the base makes its own motion, and there is nothing to refuse."""

    def outside(self, position: float) -> Refusal | None:  # noqa: ARG002
        return None

    def refusal(self, cycle: int, position: float) -> Refusal | None:  # noqa: ARG002
        return None


class ReleasedTable(ShakeTable):
    """A machine that cannot be told a position. What it can make was settled when it was set (`ReleasedMachine`).

    `enable` arms it; a set-point is what the plan expects of it, for comparison, and is never sent: the first one that
    leaves the start releases the machine, in that cycle. A stop before that disarms it. A stop after it does what the
    machine can, which is to cut the air supply of an air track and nothing on ROORI1, and waits until the base rests.

    `Sample.status` is the release device's inputs (`devices.cia401.release.Input`). Positions are counted from where
    the base is held.

    Parameters
    ----------
    bus : CanBus
        Open bus; it stays open when the table is closed.
    capacity : excitation.Capacity
        With its `machine`.
    release_node : int
        CANopen node of the release device.
    position, acceleration : SensorReading
    rotation : SensorReading, optional
        Of the block; without it `Sample.rotation` is NaN.
    inclinometer_node : int, optional
        CANopen node of an inclinometer on the block, for the tilt at rest.
    air : bool
        Whether there is an air supply to switch.
    cycle_time, clock, idle, time_limit, open_limit, state_limit, host_node
        As of `devices.cia402.master.Cia402Table`; `state_limit` must be longer than the machine takes to come to rest.
    start_window : float
        Within which the base stands in its latch, m.
    """

    follows_setpoints: ClassVar[bool] = False

    def __init__(
        self,
        bus: CanBus,
        capacity: Capacity,
        *,
        release_node: int,
        position: SensorReading,
        acceleration: SensorReading,
        rotation: SensorReading | None = None,
        inclinometer_node: int | None = None,
        air: bool = False,
        cycle_time: float = 1e-3,
        clock: Clock | None = None,
        idle: Callable[[], None] | None = None,
        time_limit: float = 0.02,
        open_limit: float = 5.0,
        state_limit: float = 30.0,
        start_window: float = 1e-3,
        host_node: int = frames.HOST_NODE,
    ) -> None:
        super().__init__(capacity, cycle_time, _RESOLUTION, start_window)
        self._limits = _Expected(capacity, cycle_time, _RESOLUTION)
        self._clock = clock or WallClock()
        sensors = [position, acceleration] + ([] if rotation is None else [rotation])
        others = [] if inclinometer_node is None else [inclinometer_node]
        self._link = ReleaseLink(bus, release_node, sensors, others, self._clock, idle, time_limit, host_node)
        tries = max(1, int(open_limit / SDO_LIMIT)) if idle is None else 3
        self._nodes = ReleasedNodes(self._link, self.name, release_node, sensors, inclinometer_node, tries)
        self._open_tries = tries
        self._state_limit = state_limit
        self._state_cycles = max(1, round(state_limit / cycle_time))
        self._spare = min(time_limit, 0.5 * cycle_time)
        self._ready = Output.ARM | (Output.AIR if air else Output(0))
        self._bus_cycle = 0
        self._next = 0.0
        self._start = 0.0
        self._released_at: int | None = None
        self._feedback = Feedback(Input(0), 0.0, 0.0, 0.0)
        self._position = 0.0

    @property
    def counts(self) -> FrameCounts:
        """Frames that were no answer: foreign, stale and so on."""
        return self._link.counts

    @property
    def position(self) -> float:
        """Last measured position, m, from where the base is held."""
        return self._position

    @property
    def inputs(self) -> Input:
        """The release device's inputs at the last SYNC it answered."""
        return self._feedback.inputs

    def reset_fault(self) -> None:
        """Forget what the nodes have complained of; no drive is in fault. DeviceNotReady as of `tilt_at_rest`."""
        if not self._opened or self._enabled:
            when = "stopped" if self._opened else "open"
            raise DeviceNotReady(f"a fault of {self.name} is to be reset before it is {when}")
        self._link.drain()
        self._link.emergencies.clear()

    def tilt_at_rest(self) -> float:
        """Return the tilt of the block that stands still, rad, by its inclinometer; NaN without one.

        Raises
        ------
        DeviceNotReady
            Before `open`, or while the machine is armed or released: a rocking block's inclinometer shows the direction
            of specific force (`devices.sensors.inclinometer`).
        """
        if not self._opened or self._enabled:
            when = "is stopped" if self._opened else "is open"
            raise DeviceNotReady(f"the tilt on {self.name} is asked for before it {when}")
        return self._nodes.tilt()

    def _open(self) -> None:
        try:
            # A node that was stopped answers no SDO before it is told to start; one that runs is not disturbed by it.
            self._link.start()
            self._nodes.check()
            self._nodes.commission()
            self._look()
        except DeviceTimeout as error:
            raise DeviceTimeout(f"{self.name} does not answer: {error}") from error

    def _look(self) -> None:
        """Send SYNC until it is answered: the first may have the number of the last host's last, and be no new one."""
        for attempt in range(self._open_tries):
            try:
                self._paced(None)
            except DeviceTimeout:
                if attempt + 1 == self._open_tries:
                    raise
            else:
                return

    def _describe(self) -> tuple[Description, ...]:
        self._paced(None, self._spare)
        return self._nodes.describe(self.inputs)

    def _enable(self, position: float) -> None:
        self._link.drain()
        self._link.trust()
        if self._link.restarted is not None:
            # A node that was restarted since has forgotten what it was told.
            self._nodes.commission()
        self._start, self._released_at = position, None
        outputs = None
        for _ in range(self._state_cycles):
            self._paced(outputs)
            self._raise_complaints()
            if Input.HELD not in self.inputs or abs(position - self.position) > self.start_window:
                raise SetpointRefused(
                    f"{self.name} is to be armed at {position:.6f} m; its base stands at {self.position:.6f} m and is "
                    f"{'' if Input.HELD in self.inputs else 'not '}held in its latch",
                    "start",
                )
            if outputs is not None and Input.ARMED in self.inputs:
                return
            outputs = self._ready
        raise DeviceTimeout(f"{self.name} is not armed within {self._state_limit:g} s; its inputs are {self.inputs!r}")

    def _exchange(self, cycle: int, steps: int, target_position: float) -> Sample:
        if steps >= frames.SYNC_COUNTS:
            raise DriveStopped(f"cycle {cycle} of {self.name} comes {steps} cycles after the last: nobody watched it")
        self._link.drain()
        self._raise_complaints()
        self._next = self._clock.now()
        if self._released_at is None and target_position != self._start:
            self._released_at = cycle
        self._cycle(self._ready | (Output(0) if self._released_at is None else Output.RELEASE), steps)
        self._check_latch(cycle)
        return self._sample(cycle)

    def _quick_stop(self, last_cycle: int, each: Callable[[Sample], object] | None) -> None:
        deadline = self._clock.now() + self._state_limit
        seen: deque[float] = deque(maxlen=max(2, round(_REST_TIME / self.cycle_time)))
        trouble: DeviceError | None = None
        for cycle in range(last_cycle + 1, last_cycle + 1 + self._state_cycles):
            if self._clock.now() > deadline:
                break
            try:
                feedback = self._paced(Output(0), self._spare, again=trouble is not None)
            except DeviceError as error:
                # Lost answers, nonsense or a bus that is gone may be over in the next cycle; giving up never helps.
                trouble = error
                continue
            trouble = None
            if each is not None and math.isfinite(feedback.position) and math.isfinite(feedback.acceleration):
                each(self._sample(cycle))
            if math.isfinite(feedback.position):
                seen.append(feedback.position)
            if self._rests(seen):
                return
        told = f"its inputs are {self.inputs!r}" if trouble is None else str(trouble)
        raise DeviceTimeout(
            f"{self.name} did not confirm a standstill within {self._state_limit:g} s ({told}): "
            "IT MAY STILL BE ARMED OR MOVING, keep clear of it"
        ) from trouble

    def _rests(self, seen: deque[float]) -> bool:
        """Return whether the machine is disarmed and its base held, or where it was for a while."""
        if Input.ARMED in self.inputs:
            return False
        if Input.HELD in self.inputs and self._released_at is None:
            return True
        return len(seen) == seen.maxlen and max(seen) - min(seen) <= _REST_DISTANCE

    def _cut_power(self, last_cycle: int, each: Callable[[Sample], object] | None) -> None:
        # What can be taken from such a machine is its outputs, at once as in any stop.
        self._quick_stop(last_cycle, each)

    def _disable(self) -> None:
        # The plan is at an end; whether the base is too, only it can say.
        self._quick_stop(-1, None)

    def _close(self) -> None:
        """Nothing of ours is left open: the bus belongs to who opened it."""

    def _paced(self, outputs: Output | None, spare: float | None = None, *, again: bool = False) -> Feedback:
        self._next = max(self._next + self.cycle_time, self._clock.now())
        # Before anything that can fail, so that trying again is paced too.
        self._clock.wait_until(self._next)
        self._link.drain()
        if again:
            # A node that restarted meanwhile answers no SYNC before it is told to.
            self._link.start()
        return self._cycle(outputs, 1, spare)

    def _cycle(self, outputs: Output | None, steps: int, spare: float | None = None) -> Feedback:
        self._bus_cycle += steps
        self._feedback = self._link.cycle(frames.sync_counter(self._bus_cycle), outputs, spare)
        if math.isfinite(self._feedback.position):
            self._position = self._feedback.position
        return self._feedback

    def _sample(self, cycle: int) -> Sample:
        inputs, position, acceleration, rotation = self._feedback
        return Sample(cycle, cycle * self.cycle_time, position, acceleration, rotation, int(inputs))

    def _check_latch(self, cycle: int) -> None:
        """Raise where the base is in its latch when it should not be, or out of it when it should."""
        if self._released_at is None:
            if Input.ARMED not in self.inputs:
                raise DriveStopped(f"{self.name} disarmed itself before its release")
            if Input.HELD not in self.inputs:
                raise DriveStopped(f"the base of {self.name} left its latch before its release")
        elif Input.HELD in self.inputs and (cycle - self._released_at) * self.cycle_time > _LATCH_LIMIT:
            raise DriveStopped(f"the base of {self.name} is still in its latch {_LATCH_LIMIT:g} s after its release")

    def _raise_complaints(self) -> None:
        if (disturbance := self._link.disturbance()) is not None:
            raise BusDisturbed(f"{disturbance} on {self._link.bus}, the bus of {self.name}")
        for node, emergency in self._link.emergencies.items():
            text = frames.emergency_text(emergency.code)
            raise DriveStopped(f"node {node} of {self.name} reports error {emergency.code:04X}: {text}")
        if self._link.restarted is not None:
            raise DriveStopped(f"node {self._link.restarted} of {self.name} is no longer operational: it was restarted")
        if (silent := self._link.silent()) is not None:
            raise DeviceTimeout(f"node {silent} of {self.name} has sent no heartbeat for {HEARTBEAT_LIMIT:g} s")
