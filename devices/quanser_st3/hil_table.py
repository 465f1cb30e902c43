"""A table on a Quanser board: the host itself closes the position loop, once a cycle, from encoder to voltage."""

from __future__ import annotations

import math
from collections import deque
from typing import TYPE_CHECKING, Any

from devices.cia402.interpolation import Interpolator
from devices.cia402.states import FOLLOWS_COMMAND, REMOTE, VOLTAGE_ENABLED, State
from devices.clock import WallClock
from devices.errors import BusFailure, DeviceError, DeviceTimeout, DriveFault, SetpointRefused
from devices.quanser_st3.hil_card import HilCard
from devices.quanser_st3.hil_clock import SampleClock
from devices.quanser_st3.hil_loop import HostLoop
from devices.sample import Description, Sample
from devices.table import ShakeTable

if TYPE_CHECKING:
    from collections.abc import Callable

    from devices.clock import Clock
    from devices.quanser_st3.hil_card import Reading
    from devices.quanser_st3.hil_settings import HilSettings
    from excitation import Capacity

_FOLLOWING_ERROR, _TOO_FAR = 0x8611, 0x8612
"""CiA 402's codes for the same."""
_RESOLUTION = 1e-9
_STILL = 10
"""Cycles in which the table has not moved, at a standstill."""
_STATUS = {
    State.OPERATION_ENABLED: State.OPERATION_ENABLED.value[1] | VOLTAGE_ENABLED | REMOTE | FOLLOWS_COMMAND,
    State.QUICK_STOP_ACTIVE: State.QUICK_STOP_ACTIVE.value[1] | VOLTAGE_ENABLED | REMOTE,
    State.FAULT_REACTION_ACTIVE: State.FAULT_REACTION_ACTIVE.value[1] | REMOTE,
}
"""Samples tell their state as a CiA 402 drive would."""


class HilTable(ShakeTable):
    """A shake table whose amplifier and encoders are on a Quanser board.

    The motor pushes from the first `exchange` on, not before. The output is 0 V after `close`, `disable` and a stop,
    and after whatever goes wrong in a cycle; where the host itself is gone, within `HilSettings.watchdog`. A stop
    brakes the table first, with the loop closed; after what went wrong in a cycle it coasts.

    Not done: homing (Quanser's own calibration first sets the counter to 0 at the centre), limit switches, a second
    axis.

    Parameters
    ----------
    capacity : excitation.Capacity
    settings : HilSettings
    hardware : module
        `quanser.hardware`, or what stands in for it.
    cycle_time : float
        s.
    wall : Clock, optional
        The computer's; the wall clock unless told.
    stop_deceleration : float
        Of a stop, m/s2, as long as the stroke left allows it.
    following_error : float
        Largest distance between set-point and measured position, m; beyond it the output is 0 V.
    state_limit : float
        For a stop, s.
    rotation : bool
        Whether there is an encoder on the specimen; without it `Sample.rotation` is NaN.
    start_window : float
        Largest distance between the position to be enabled at and the measured one, m.

    Attributes
    ----------
    clock : SampleClock
        What the cycles of a run are to be paced by.
    """

    def __init__(
        self,
        capacity: Capacity,
        settings: HilSettings,
        hardware: Any,
        *,
        cycle_time: float = 1e-3,
        wall: Clock | None = None,
        stop_deceleration: float = 1.0,
        following_error: float = 20e-3,
        state_limit: float = 3.0,
        rotation: bool = True,
        start_window: float = 20e-6,
    ) -> None:
        super().__init__(capacity, cycle_time, _RESOLUTION, start_window)
        self._settings = settings
        self._loop = HostLoop(settings, cycle_time)
        self._card = HilCard(hardware, settings, cycle_time)
        self._wall = wall or WallClock()
        self.clock = SampleClock(self._card, cycle_time, self._wall)
        self._deceleration = stop_deceleration
        self._following_error = following_error
        self._state_limit = state_limit
        self._rotation = rotation
        self._setpoint = self._speed = self._position = 0.0
        self._number = -1
        self._coasting = False

    @property
    def counts(self) -> str:
        """Nothing is heard here but answers."""
        return f"{self._card.name}: no bus"

    @property
    def position(self) -> float:
        """Last measured position, m: where to `enable`. Known once open."""
        return self._position

    def reset_fault(self) -> None:
        """Forget that the watchdog expired; the output stays 0 V.

        Raises
        ------
        DeviceNotReady
            Before `open`, or while the table takes set-points: stop it first.
        """
        self._require_idle(f"a fault of {self.name} is to be reset")
        self._card.clear()

    def _open(self) -> None:
        try:
            self._card.open()
            self._measure(self._card.look())
        except BaseException:
            self._card.close()
            raise

    def _describe(self) -> tuple[Description, ...]:
        state = "watchdog expired" if self._card.expired else "output at 0 V"
        software = f"HIL {self._card.version()}"
        mode = "position loop on this computer"
        return (Description(None, "drive", self._card.name, "", software, 0, 0, 0, 0, state, mode),)

    def _enable(self, position: float) -> None:
        self._measure(self._card.look())
        if self._card.expired:
            raise DriveFault(
                f"the watchdog of {self._card.name} expired; once its cause is gone, acknowledge it with reset_fault "
                "(twin run --reset)"
            )
        if abs(position - self._position) > self.start_window:
            raise SetpointRefused(
                f"{self.name} is to be enabled at {position:.6f} m; it stands at {self._position:.6f} m", "start"
            )
        self._setpoint, self._speed, self._coasting = position, 0.0, False

    def _exchange(self, cycle: int, steps: int, target_position: float) -> Sample:
        try:
            if not self.clock.running:
                self.clock.start()
            return self._cycle(cycle, target_position, State.OPERATION_ENABLED, steps)
        except BaseException:
            # Whatever it was, the motor does not push on with the last voltage until the watchdog takes it away.
            self._coasting = True
            self._zero()
            raise

    def _cycle(self, cycle: int, target: float, state: State, steps: int = 1) -> Sample:
        """Take a sample, and push towards where the set-point is in the middle of the cycle the output is held over."""
        reading = self.clock.take()
        self._number = cycle
        velocity = self.clock.change * self._settings.encoder_step / self.cycle_time
        position = self._measure(reading)
        change = (target - self._setpoint) / steps
        setpoint = target - 0.5 * change
        self._judge(position, setpoint)
        self._card.write(self._loop.voltage(setpoint, position, velocity))
        self._setpoint, self._speed = target, change / self.cycle_time
        return self._sample(cycle, reading, state)

    def _judge(self, position: float, setpoint: float) -> None:
        half, beyond = 0.5 * self.capacity.stroke, self._settings.overtravel
        if abs(position) > half + beyond:
            raise DriveFault(
                f"{self.name} is at {position * 1e3:.2f} mm; its stroke ends at {half * 1e3:g} mm", _TOO_FAR
            )
        if abs(setpoint - position) > self._following_error:
            raise DriveFault(
                f"{self.name} is {abs(setpoint - position) * 1e3:.2f} mm from its set-point; "
                f"the limit is {self._following_error * 1e3:g} mm",
                _FOLLOWING_ERROR,
            )

    def _quick_stop(self, last_cycle: int, each: Callable[[Sample], object] | None) -> None:
        trouble: DeviceError | None = None
        self._number, braked = last_cycle, False
        try:
            if self.clock.running and not self._coasting:
                self._brake(each)
                braked = True
        except DeviceError as error:
            trouble = error
        finally:
            trouble = self._let_go() or trouble
        self._await_standstill(None if braked else each, trouble)

    def _cut_power(self, last_cycle: int, each: Callable[[Sample], object] | None) -> None:  # noqa: ARG002
        self._await_standstill(each, self._let_go())

    def _let_go(self) -> DeviceError | None:
        """Take the voltage off and end the sampling; return what went wrong."""
        self._coasting = True
        try:
            self.clock.stop()
        except BusFailure as error:
            return error
        return None

    def _brake(self, each: Callable[[Sample], object] | None) -> None:
        """Ramp down with the loop closed."""
        ramp = Interpolator(self.capacity, self.cycle_time, self.resolution, self._deceleration, 0)
        ramp.lead(self._setpoint, self._speed)
        way: deque[float] = deque(maxlen=_STILL)
        for _ in range(max(1, round(self._state_limit / self.cycle_time))):
            sample = self._cycle(self._number + 1, ramp.step(), State.QUICK_STOP_ACTIVE)
            if each is not None:
                each(sample)
            way.append(sample.position)
            if ramp.at_rest and self._still(way):
                return

    def _await_standstill(self, each: Callable[[Sample], object] | None, trouble: DeviceError | None) -> None:
        """Return once the output is 0 V and the table stands; the sampling is over, so the encoders are asked."""
        way: deque[float] = deque(maxlen=_STILL)
        begin = self._wall.now()
        for n in range(1, max(_STILL, round(self._state_limit / self.cycle_time)) + 1):
            self._wall.wait_until(begin + n * self.cycle_time)
            if self._wall.now() > begin + 2.0 * self._state_limit:
                break  # each answer takes long
            try:
                self._card.write(0.0)
                reading = self._card.look()
            except BusFailure as error:
                trouble = error
                way.clear()
                continue
            way.append(self._measure(reading))
            if each is not None:
                each(self._sample(self._number + n, reading, State.FAULT_REACTION_ACTIVE))
            if self._still(way):
                return
        told = "it still moves" if trouble is None else str(trouble)
        raise DeviceTimeout(
            f"{self.name} did not confirm a standstill within {self._state_limit:g} s ({told}): "
            "THE TABLE MAY STILL BE MOVING, use its emergency stop"
        ) from trouble

    def _disable(self) -> None:
        self._quick_stop(-1 if self._last_cycle is None else self._last_cycle, None)

    def _close(self) -> None:
        try:
            if not self._zero():
                # The watchdog does it, if the board is not closed before it can.
                self._wall.wait_until(self._wall.now() + 2.0 * self._settings.watchdog)
        finally:
            self._card.close()

    def _zero(self) -> bool:
        """Put the output at 0 V; return whether the board took it."""
        try:
            self._card.write(0.0)
        except BusFailure:
            return False
        return True

    def _still(self, way: deque[float]) -> bool:
        # Two counts: an encoder may rest on an edge.
        return len(way) == _STILL and max(way) - min(way) <= 2.01 * abs(self._settings.encoder_step)

    def _measure(self, reading: Reading) -> float:
        self._position = (reading.encoder - self._settings.centre_count) * self._settings.encoder_step
        return self._position

    def _sample(self, cycle: int, reading: Reading, state: State) -> Sample:
        s = self._settings
        acceleration = (reading.accelerometer - s.accelerometer_zero) * s.accelerometer_gain
        rotation = (reading.rotation - s.upright_count) * s.rotation_step if self._rotation else math.nan
        return Sample(cycle, cycle * self.cycle_time, self._position, acceleration, rotation, _STATUS[state])
