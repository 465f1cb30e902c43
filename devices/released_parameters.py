"""What emulated released machines measure with and how late they let go; a user's own `[emulator]` table."""

from __future__ import annotations

from typing import Annotated, Any, ClassVar

from pydantic import Field

from devices.own_table import Keys, OwnNumbers

_DATA_SHEET = "a guess: take your data sheet's"


def _number(source: str, *, least: float | None = None, above: float | None = None, most: float | None = None) -> Any:
    return Field(strict=True, ge=least, gt=above, le=most, allow_inf_nan=False, description=source)


class MeasuringParameters(OwnNumbers):
    """Sensors and delay of an emulated released machine.

    Attributes
    ----------
    encoder_step : float
        Of the base's position, m; 0 for none.
    accelerometer_noise, accelerometer_bias, accelerometer_range : float
        m/s2; the noise is the standard deviation of one reading, the range its largest size.
    release_delay : float
        From the output to the base's release, s: a magnet, a valve, the projectile's flight. The plan does not know it.
    """

    keys: ClassVar[Keys] = {
        "encoder_step_um": ("encoder_step", 1e-6),
        "accelerometer_noise_m_s2": ("accelerometer_noise", 1.0),
        "accelerometer_bias_m_s2": ("accelerometer_bias", 1.0),
        "accelerometer_range_m_s2": ("accelerometer_range", 1.0),
        "release_delay_ms": ("release_delay", 1e-3),
    }

    encoder_step: Annotated[float, _number(_DATA_SHEET, least=0.0)] = 1e-6
    accelerometer_noise: Annotated[float, _number(_DATA_SHEET, least=0.0)] = 5e-3 * 9.81
    accelerometer_bias: Annotated[float, _number(_DATA_SHEET)] = 2e-3 * 9.81
    accelerometer_range: Annotated[float, _number(_DATA_SHEET, above=0.0)] = 50.0 * 9.81
    release_delay: Annotated[float, _number("a guess: measure it", least=0.0, most=1.0)] = 2e-3
