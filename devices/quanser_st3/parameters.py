"""What the emulated ST-III is made of: numbers, where each comes from, and a user's own `[emulator]` table."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from pydantic import Field, model_validator

from devices.own_table import Keys, OwnNumbers, read_own
from devices.quanser_st3.loop import LinearLoop

if TYPE_CHECKING:
    from excitation import Capacity

_CALCULATED = "the Shake Table II's, calculated from Quanser's set-up scripts: a placeholder"
_READ = "the Shake Table II's, read in Quanser's set-up scripts: a placeholder"
_GUESS = "a guess: measure your table"


def _number(source: str, *, above: float | None = 0.0, least: float | None = None, most: float | None = None) -> Any:
    return Field(strict=True, gt=above, ge=least, le=most, allow_inf_nan=False, description=source)


_KEYS: Keys = {
    "loop_frequency_hz": ("loop_frequency", 1.0),
    "loop_damping": ("loop_damping", 1.0),
    "delay_ms": ("delay", 1e-3),
    "moving_mass_kg": ("moving_mass", 1.0),
    "torque_constant_n_m_a": ("torque_constant", 1.0),
    "peak_current_a": ("peak_current", 1.0),
    "screw_lead_mm": ("screw_lead", 1e-3),
    "top_speed_m_s": ("top_speed", 1.0),
    "switch_distance_mm": ("switch_distance", 1e-3),
    "bumper_distance_mm": ("bumper_distance", 1e-3),
    "home_width_mm": ("home_width", 1e-3),
    "bumper_stiffness_n_m": ("bumper_stiffness", 1.0),
    "bumper_damping_n_s_m": ("bumper_damping", 1.0),
    "friction_n": ("friction", 1.0),
    "encoder_step_um": ("encoder_step", 1e-6),
    "accelerometer_noise_m_s2": ("accelerometer_noise", 1.0),
    "accelerometer_bias_m_s2": ("accelerometer_bias", 1.0),
    "accelerometer_range_m_s2": ("accelerometer_range", 1.0),
    "substeps": ("substeps", 1.0),
}
"""Of the table `[emulator]`."""


class St3Parameters(OwnNumbers):
    """Parameters of the emulated table: frequency and damping of its position loop are those of the empty table.

    A payload rides rigidly on the table. The drive's gains stay what they are, so that on an inertia

        (M0 + m) x'' = M0 (w0^2 (r - x) - 2 zeta0 w0 x')

    and both fall by the same root: w = w0 sqrt(M0 / (M0 + m)), zeta = zeta0 sqrt(M0 / (M0 + m)). How a rocking block
    pushes back on the table is not in it.

    Attributes
    ----------
    loop_frequency, loop_damping : float
        Natural frequency, Hz, and damping ratio of the empty table's closed position loop.
    delay : float
        From a set-point to the moment the loop takes it, s; need not be a whole number of cycles.
    moving_mass : float
        Of the empty table, M0, kg.
    torque_constant, peak_current, screw_lead : float
        N m/A, A, m/rev: together the largest force.
    top_speed : float
        m/s, above which the drive does not push.
    switch_distance, bumper_distance : float
        From the end of the stroke to the limit switch and to the bumper, m.
    home_width : float
        m about the centre in which the home switch is closed.
    bumper_stiffness, bumper_damping : float
        N/m, N s/m; a bumper pushes and never pulls.
    friction : float
        Of table and screw without power, N. With power it is part of the loop's measured damping.
    encoder_step : float
        m; 0 for none.
    accelerometer_noise, accelerometer_bias, accelerometer_range : float
        Standard deviation of one sample, offset, largest reading of either sign, m/s2.
    substeps : int
        Steps of the specimen in one cycle.
    Examples
    --------
    >>> p = St3Parameters()
    >>> round(p.largest_force), round(p.largest_acceleration(payload=100.0), 1)
    (2672, 24.8)
    >>> round(p.loop(payload=100.0).angular_frequency / p.loop().angular_frequency, 3)
    0.268
    """

    keys: ClassVar[Keys] = _KEYS

    loop_frequency: Annotated[float, _number(_CALCULATED, most=1000.0)] = 31.9
    loop_damping: Annotated[float, _number(_CALCULATED, most=100.0)] = 0.78
    delay: Annotated[float, _number(f"one cycle at 1 kHz, {_GUESS}", above=None, least=0.0, most=0.1)] = 1e-3
    moving_mass: Annotated[float, _number(_READ)] = 7.74
    torque_constant: Annotated[float, _number(_READ)] = 0.360
    peak_current: Annotated[float, _number(_READ)] = 15.0
    screw_lead: Annotated[float, _number(_READ)] = 12.7e-3
    top_speed: Annotated[float, _number(f"a fifth above the placeholder capacity, {_GUESS}")] = 0.8
    switch_distance: Annotated[float, _number(_GUESS)] = 5e-3
    bumper_distance: Annotated[float, _number(_GUESS)] = 10e-3
    home_width: Annotated[float, _number(_GUESS)] = 5e-3
    bumper_stiffness: Annotated[float, _number(_GUESS, most=1e8)] = 2e5
    bumper_damping: Annotated[float, _number(_GUESS, above=None, least=0.0, most=1e6)] = 900.0
    friction: Annotated[float, _number(_GUESS)] = 30.0
    encoder_step: Annotated[float, _number(_READ, above=None, least=0.0)] = 12.7e-3 / 8192
    accelerometer_noise: Annotated[float, _number(_GUESS, above=None, least=0.0)] = 5e-3 * 9.81
    accelerometer_bias: Annotated[float, _number(_GUESS, above=None)] = 2e-3 * 9.81
    accelerometer_range: Annotated[float, _number(_GUESS)] = 5.0 * 9.81
    substeps: Annotated[int, _number("chosen", most=1000)] = 1

    @model_validator(mode="after")
    def _bumper_behind_switch(self) -> St3Parameters:
        if self.bumper_distance <= self.switch_distance:
            raise ValueError(
                f"bumper_distance is {self.bumper_distance:g} m; it must be above switch_distance, "
                f"{self.switch_distance:g} m"
            )
        return self

    def loop(self, payload: float = 0.0) -> LinearLoop:
        """Return the closed loop with `payload`, kg, on the table, as long as nothing saturates."""
        root = math.sqrt(self.moving_mass / (self.moving_mass + payload))
        return LinearLoop(math.tau * self.loop_frequency * root, self.loop_damping * root, self.delay)

    @property
    def force_per_ampere(self) -> float:
        """2 pi Kt / lead, N/A: a screw without losses."""
        return math.tau * self.torque_constant / self.screw_lead

    @property
    def largest_force(self) -> float:
        """What the motor pushes with at its peak current, N."""
        return self.force_per_ampere * self.peak_current

    def largest_acceleration(self, payload: float = 0.0) -> float:
        """Return what the largest force makes of the empty table and `payload`, kg; m/s2."""
        return self.largest_force / (self.moving_mass + payload)

    def notes(self, capacity: Capacity, payload: float) -> list[str]:
        """Return what the motor leaves of the capacity with `payload`, kg, where that is less.

        Examples
        --------
        >>> from devices.quanser_st3.capacity import CAPACITY
        >>> St3Parameters(peak_current=5.0).notes(CAPACITY, 100.0)
        ['with 100 kg on it the motor makes 8.27 m/s2; the capacity says 9.81 m/s2']
        >>> St3Parameters().notes(CAPACITY, 100.0)
        []
        """
        said: list[str] = []
        if (able := self.largest_acceleration(payload)) < capacity.acceleration:
            said.append(
                f"with {payload:.4g} kg on it the motor makes {able:.3g} m/s2; "
                f"the capacity says {capacity.acceleration:.3g} m/s2"
            )
        if self.top_speed < capacity.velocity:
            said.append(
                f"the drive pushes up to {self.top_speed:.3g} m/s; the capacity says {capacity.velocity:.3g} m/s"
            )
        return said


def load_parameters(table: Mapping[str, object]) -> St3Parameters:
    """Return the parameters with a user's own numbers, those of the table `[emulator]` of a capacity file, in them.

    Raises
    ------
    ValueError
        One sentence: an unknown key, a number out of its range.

    Examples
    --------
    >>> p = load_parameters({"delay_ms": 2.5, "provenance": {"delay_ms": "step test of 3 May"}})
    >>> p.delay, p.source("delay")
    (0.0025, 'step test of 3 May')
    """
    return read_own(St3Parameters, table, "emulator")
