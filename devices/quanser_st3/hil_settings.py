"""How an ST-III is wired to Quanser's HIL board, and what its position loop is made of."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, Any, ClassVar

from pydantic import Field, model_validator

from devices.errors import BusUnavailable
from devices.own_table import Keys, OwnNumbers, read_own
from devices.quanser_st3.parameters import St3Parameters

_ST2 = St3Parameters()
_CHOSEN = "chosen"
_MANUAL = "Quanser's set-up scripts of the Shake Table II: a placeholder"

_Channel = Annotated[int, Field(strict=True, ge=0, le=63)]
_Count = Annotated[int, Field(strict=True, ge=-(2**31), le=2**31 - 1)]
_Positive = Annotated[float, Field(strict=True, gt=0.0, allow_inf_nan=False)]
_Finite = Annotated[float, Field(strict=True, allow_inf_nan=False)]


def _given(value: Any, source: str) -> Any:
    return Field(default=value, description=source)


_KEYS: Keys = {
    "board": ("board", 1.0),
    "identifier": ("identifier", 1.0),
    "amperes_per_volt": ("amperes_per_volt", 1.0),
    "output_channel": ("output_channel", 1.0),
    "output_limit_v": ("output_limit", 1.0),
    "encoder_channel": ("encoder_channel", 1.0),
    "encoder_step_um": ("encoder_step", 1e-6),
    "centre_count": ("centre_count", 1.0),
    "rotation_channel": ("rotation_channel", 1.0),
    "rotation_step_mrad": ("rotation_step", 1e-3),
    "upright_count": ("upright_count", 1.0),
    "accelerometer_channel": ("accelerometer_channel", 1.0),
    "accelerometer_m_s2_per_v": ("accelerometer_gain", 1.0),
    "accelerometer_zero_v": ("accelerometer_zero", 1.0),
    "tristate_channels": ("tristate_channels", 1.0),
    "watchdog_ms": ("watchdog", 1e-3),
    "built_in_zero": ("built_in_zero", 1.0),
    "overtravel_mm": ("overtravel", 1e-3),
    "loop_frequency_hz": ("loop_frequency", 1.0),
    "loop_damping": ("loop_damping", 1.0),
    "moving_mass_kg": ("moving_mass", 1.0),
    "torque_constant_n_m_a": ("torque_constant", 1.0),
    "screw_lead_mm": ("screw_lead", 1e-3),
    "peak_current_a": ("peak_current", 1.0),
}
"""Of the table `[hil]`."""


class HilSettings(OwnNumbers):
    """Wiring and gains. Board and amplifier have no default: nobody but you knows them.

    Attributes
    ----------
    board, identifier : str
        As Quanser names them: "q8_usb", "0".
    amperes_per_volt : float
        Motor current over analog output, A/V; negative where a positive voltage pushes to -x.
    output_channel : int
        Analog output of the amplifier.
    output_limit : float
        Largest output, V.
    encoder_channel : int
    encoder_step : float
        m per count; negative where counts fall towards +x.
    centre_count : int
        Count at the centre of the stroke. This driver does not home: Quanser's own calibration zeroes the count there.
    rotation_channel : int
        Encoder of the specimen's rotation.
    rotation_step : float
        rad per count; negative where counts fall as the top leans to +x.
    upright_count : int
        Count of the specimen standing upright.
    accelerometer_channel : int
        Analog input.
    accelerometer_gain, accelerometer_zero : float
        (m/s2)/V, and V at rest.
    tristate_channels : list of int
        Digital outputs that let go as the watchdog expires: Quanser's Q8 boards want all of them for their analog
        outputs to fall to 0 V.
    watchdog : float
        s.
    built_in_zero : bool
        Whether the board's outputs fall to 0 V with its watchdog by themselves. Otherwise the board is told to, and one
        that refuses is not used.
    overtravel : float
        How far beyond the stroke a measured position may be before the output is 0 V for good, m.
    loop_frequency, loop_damping : float
        Of the position loop, Hz and 1, with the empty table.
    moving_mass, torque_constant, screw_lead, peak_current : float
        kg, N m/A, m/rev, A: what the loop's gains and its limit are made of.
    """

    keys: ClassVar[Keys] = _KEYS

    board: Annotated[str, Field(strict=True, min_length=1, description="yours")]
    amperes_per_volt: Annotated[float, Field(strict=True, allow_inf_nan=False, description="yours")]
    identifier: Annotated[str, Field(strict=True, min_length=1)] = _given("0", _CHOSEN)
    output_channel: _Channel = _given(0, _CHOSEN)
    output_limit: _Positive = _given(10.0, "the usual range of Quanser's boards, recalled: a placeholder")
    encoder_channel: _Channel = _given(0, _CHOSEN)
    encoder_step: _Finite = _given(_ST2.encoder_step, _MANUAL)
    centre_count: _Count = _given(0, _CHOSEN)
    rotation_channel: _Channel = _given(1, _CHOSEN)
    rotation_step: _Finite = _given(math.tau / 40000, "an encoder of 10 000 lines, a guess: yours")
    upright_count: _Count = _given(0, _CHOSEN)
    accelerometer_channel: _Channel = _given(0, _CHOSEN)
    accelerometer_gain: _Finite = _given(9.81, _MANUAL)
    accelerometer_zero: _Finite = _given(0.0, _CHOSEN)
    tristate_channels: list[_Channel] = _given([], _CHOSEN)
    watchdog: _Positive = _given(5e-3, _MANUAL)
    built_in_zero: Annotated[bool, Field(strict=True)] = _given(False, _CHOSEN)
    overtravel: _Positive = _given(3e-3, _CHOSEN)
    loop_frequency: _Positive = _given(_ST2.loop_frequency, _ST2.source("loop_frequency"))
    loop_damping: _Positive = _given(_ST2.loop_damping, _ST2.source("loop_damping"))
    moving_mass: _Positive = _given(_ST2.moving_mass, _MANUAL)
    torque_constant: _Positive = _given(_ST2.torque_constant, _MANUAL)
    screw_lead: _Positive = _given(_ST2.screw_lead, _MANUAL)
    peak_current: _Positive = _given(_ST2.peak_current, _MANUAL)

    @model_validator(mode="after")
    def _gains_are_not_nothing(self) -> HilSettings:
        for name in ("amperes_per_volt", "encoder_step", "rotation_step", "accelerometer_gain"):
            if getattr(self, name) == 0.0:
                raise ValueError(f"{name} is 0; it must not be")
        return self


def load_settings(table: Mapping[str, object]) -> HilSettings:
    """Return the settings of the table `[hil]` of a capacity file.

    Raises
    ------
    BusUnavailable
        Where board or amplifier are not said.
    ValueError
        One sentence: an unknown key, a number out of its range.
    """
    missing = [key for key in ("board", "amperes_per_volt") if key not in table]
    if missing:
        raise BusUnavailable(
            f"a table on Quanser's HIL API needs {' and '.join(missing)} in the table [hil] of its capacity file"
        )
    return read_own(HilSettings, table, "hil")
