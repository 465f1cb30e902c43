"""The moving side of an emulated drive: set-points into the machine, measurements out, in the drive's coordinate."""

from __future__ import annotations

from typing import TYPE_CHECKING

from devices.cia402.homing_mode import HomingMode
from devices.cia402.interpolation import Interpolator
from devices.cia402.machine import Paced, Powered, Switched, Switches
from devices.cia402.supervision import Supervision

if TYPE_CHECKING:
    from devices.cia402.machine import DriveOptions, Machine
    from devices.cia402.parameters import Parameters
    from excitation import Capacity

_NO_SWITCHES = Switches()
_STANDSTILL = 1e-4


class Axis:
    """One machine, at rest at set-point `position`, m, to begin with.

    Parameters
    ----------
    machine : Machine
    parameters : Parameters
    capacity : excitation.Capacity
    cycle_time : float
        s.
    resolution : float
        Of positions on the bus, m.
    options : DriveOptions
    position : float
        m.

    Attributes
    ----------
    interpolator : Interpolator
        The set-point.
    homing : HomingMode
    supervision : Supervision
    stroke : float
        Of the capacity, m.
    zero : float
        Where the drive's zero is on the machine, m; homing moves it.
    measured : float
        Position as of the last cycle, m, in the drive's coordinate.
    """

    def __init__(
        self,
        machine: Machine,
        parameters: Parameters,
        capacity: Capacity,
        cycle_time: float,
        resolution: float,
        options: DriveOptions,
        position: float,
    ) -> None:
        self.interpolator = Interpolator(capacity, cycle_time, resolution, options.stop_deceleration, options.patience)
        self.interpolator.hold(position)
        self.stroke = capacity.stroke
        self.homing = HomingMode(parameters, capacity.stroke)
        self.supervision = Supervision()
        self.zero = 0.0
        self._parameters = parameters
        self.couple(machine)

    def couple(self, machine: Machine) -> None:
        """Move this machine from now on, at rest and without power: the table, or a fault that stands before it."""
        self.machine = machine
        self.measured = machine.measure_position() - self.zero
        # Asking a machine what it offers is too slow to do each cycle.
        self._switched = machine if isinstance(machine, Switched) else None
        self._powered = machine if isinstance(machine, Powered) else None
        self.power(False)

    @property
    def cycle_time(self) -> float:
        """Time between two cycles, s."""
        return self.interpolator.limits.cycle_time

    @property
    def has_switches(self) -> bool:
        """Whether there are limit switches to home to."""
        return self._switched is not None

    @property
    def switches(self) -> Switches:
        """The drive's digital inputs."""
        return _NO_SWITCHES if self._switched is None else self._switched.switches

    @property
    def moving(self) -> bool:
        """Whether set-point or machine moves now."""
        led = self.homing.active or self.interpolator.velocity != 0.0
        return led or abs(self.machine.velocity) >= _STANDSTILL

    @property
    def standstill(self) -> bool:
        """Whether nothing moves and no set-point is awaited."""
        return not self.moving and not self.interpolator.following

    def start(self, cycle: int, target: float | None) -> None:
        """Take the parameters over, switch the power on, and begin in `cycle` at `target`, m; None holds the place."""
        p, interpolator = self._parameters, self.interpolator
        interpolator.stop(p.deceleration(0x605E))
        interpolator.patience = p.patience
        self.supervision.start(p, self.cycle_time)
        self.power(True)
        if self._powered is not None or abs(self.measured - interpolator.position) > p.start_window:
            # Without power it may have been pushed. A machine that is held all the time has its last set-point.
            interpolator.hold(self.measured)
        if target is not None:
            interpolator.begin(cycle, target)

    def stop(self, option: int) -> None:
        """Ramp down from whatever it is doing, as the option code 605A or 605E says."""
        # Homing goes beyond the software limits: nothing but its own acceleration is sure to end there.
        deceleration = max(self._parameters.deceleration(option), self.homing.acceleration)
        if not self.homing.active and not self.interpolator.following and self.interpolator.velocity != 0.0:
            # A second reason to stop makes no ramp gentler than it is.
            deceleration = max(deceleration, self.interpolator.stop_deceleration)
        self.homing.end()
        self.interpolator.stop(deceleration)

    def let_go(self) -> None:
        """Stop pushing at once: the machine runs down by itself. One whose power cannot be taken ramps down."""
        if self._powered is None:
            self.stop(0x605A)
            return
        self.homing.end()
        self.interpolator.hold(self.measured)
        self.power(False)

    def power(self, on: bool) -> None:
        """Let the machine know whether the drive pushes, where it wants to."""
        if self._powered is not None:
            self._powered.powered = on

    def pace(self, cycle_time: float) -> bool:
        """Let every later cycle take `cycle_time`, s, where the machine can; only at rest."""
        if not isinstance(self.machine, Paced):
            return False
        self.machine.pace(cycle_time)
        self.interpolator.limits.cycle_time = cycle_time
        return True

    def live(self, *, synced: bool) -> None:
        """Live through one cycle; `synced` is whether a SYNC came for it."""
        homing, interpolator = self.homing, self.interpolator
        if homing.active:
            setpoint, velocity = homing.step(self.switches, self.measured + self.zero, synced=synced)
            interpolator.lead(setpoint - self.zero, velocity)
        else:
            setpoint = interpolator.step() + self.zero
        self.machine.advance(setpoint)
        if homing.active and (zero := homing.conclude()) is not None:
            self.zero = zero
            interpolator.hold(setpoint - zero)
        self.measured = self.machine.measure_position() - self.zero

    def complaint(self) -> int | None:
        """Return the emergency code of what is wrong with a machine that is pushed, or None."""
        ahead, homing = self.interpolator, self.homing.active
        return self.supervision.complaint(ahead.position - self.measured, ahead.velocity, self.switches, homing=homing)

    def home(self, controlword: int) -> None:
        """Obey a controlword in homing mode."""
        here = self.interpolator.position + self.zero
        self.homing.command(controlword, here, self.interpolator.limits, standstill=self.standstill)
