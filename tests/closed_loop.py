"""A table that follows its set-points through a second-order lag and nothing else: an exact plant for tests."""

from __future__ import annotations

from devices.quanser_st3.loop import LinearLoop, LinearStep


class ClosedLoop:
    """State of the loop, rad/s and damping ratio given, advanced exactly by steps of one length."""

    def __init__(self, angular_frequency: float, damping: float, step: float, position: float) -> None:
        self._step = LinearStep(LinearLoop(angular_frequency, damping), step)
        self._stiffness = angular_frequency**2
        self._friction = 2.0 * damping * angular_frequency
        self.position = self.setpoint = position
        self.velocity = 0.0

    @property
    def acceleration(self) -> float:
        """m/s2, now."""
        return self._stiffness * (self.setpoint - self.position) - self._friction * self.velocity

    def advance(self, setpoint: float) -> None:
        """Live through one step while the set-point goes linearly to `setpoint`, m."""
        self.position, self.velocity = self._step.advance(self.position, self.velocity, self.setpoint, setpoint)
        self.setpoint = setpoint
