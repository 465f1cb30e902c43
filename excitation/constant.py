"""A constant acceleration."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field
from pydantic.dataclasses import dataclass

from excitation.pieces import Array, assemble, steady
from excitation.pulse import Pulse
from excitation.quantity import VALUE, checked, quantity


@dataclass(frozen=True, config=VALUE)
class ConstantPulse(Pulse):
    """Acceleration a0 from 0 to ta; the base is left moving at a0 ta, so a run of it needs a brake.

    Parameters
    ----------
    acceleration : float
        a0, m/s2, positive towards +x; 0 stands still. It is kept as `amplitude`, for `acceleration(t)` is the motion.
    duration : float
        ta, s, above 0.

    Raises
    ------
    pydantic.ValidationError
        A `ValueError`; its message names the value, its limit and unit.

    Examples
    --------
    >>> pulse = ConstantPulse(2.0, 0.5)
    >>> pulse.final_velocity, pulse.net_displacement, pulse.velocity(0.25)
    (1.0, 0.25, 0.5)
    """

    amplitude: Annotated[float, quantity("m/s2", name="acceleration")] = Field(alias="acceleration")
    # A frozen field answers exactly as the cached property it stands for.
    duration: Annotated[float, quantity("s", above=0.0)] = Field()  # pyright: ignore[reportIncompatibleVariableOverride]

    @property
    def family(self) -> str:
        """What a capacity's `kinds` call it."""
        return "constant"

    @property
    def kind(self) -> str:
        """What sentences call it."""
        return "constant pulse"

    def scaled(self, factor: float) -> ConstantPulse:
        """Return the pulse of the same duration with the acceleration times `factor`."""
        return ConstantPulse(self.amplitude * checked("factor", factor), self.duration)

    def _rows(self) -> Array:
        return assemble([steady(self.duration, self.amplitude)])
