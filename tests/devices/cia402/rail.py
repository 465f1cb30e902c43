"""A machine on a rail for the tests of the drive: stiff, with limit switches and all else a machine may offer."""

from __future__ import annotations

from devices.cia402.machine import Switches


class Rail:
    """Is where it is told to be, once a cycle; switches close beyond `end`, m, of either side."""

    def __init__(self, position: float = 0.0, end: float = 0.102, cycle_time: float = 1e-3) -> None:
        self.position = self.setpoint = position
        self.velocity = 0.0
        self.end = end
        self.cycle_time = cycle_time
        self.powered = True
        self.stop = False
        self.blocked = False
        self.powers: list[bool] = []
        self.path: list[float] = [position]

    def __setattr__(self, name: str, value: object) -> None:
        if name == "powered" and hasattr(self, "powers"):
            self.powers.append(bool(value))
        super().__setattr__(name, value)

    def advance(self, setpoint: float) -> None:
        """Go there, unless it is held."""
        self.setpoint = setpoint
        before = self.position
        if self.powered and not self.blocked:
            self.position = setpoint
        self.velocity = (self.position - before) / self.cycle_time
        self.path.append(self.position)

    def measure_position(self) -> float:
        """Without noise or steps."""
        return self.position

    def measure_acceleration(self) -> float:
        """A number to be recognised."""
        return 1.5

    @property
    def switches(self) -> Switches:
        """Both limit switches and the emergency stop."""
        return Switches(self.position <= -self.end, self.position >= self.end, abs(self.position) < 1e-4, self.stop)

    def pace(self, cycle_time: float) -> None:
        """Any cycle will do."""
        self.cycle_time = cycle_time
