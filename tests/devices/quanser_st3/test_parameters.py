"""The emulated table's numbers: bounds, provenance, and a user's own."""

from __future__ import annotations

import math

import pytest
from pydantic import ValidationError

from devices.quanser_st3.capacity import CAPACITY
from devices.quanser_st3.parameters import St3Parameters, load_parameters


@pytest.mark.parametrize(
    "wrong",
    [
        {"loop_frequency": 0.0},
        {"loop_damping": -1.0},
        {"encoder_step": math.nan},
        {"accelerometer_bias": math.inf},
        {"substeps": 0},
        {"substeps": 1.5},
        {"delay": -1e-3},
        {"delay": 0.2},
        {"moving_mass": 0.0},
        {"bumper_distance": 5e-3},
        {"bumper_damping": 1e9},
        {"unknown": 1.0},
    ],
)
def test_parameters_are_bounded(wrong: dict[str, float]) -> None:
    with pytest.raises(ValidationError):
        St3Parameters(**wrong)


def test_force_from_the_motor_s_data() -> None:
    p = St3Parameters()
    # Kt I = F lead / (2 pi): 0.360 * 15 * 2 pi / 12.7e-3
    assert p.largest_force == pytest.approx(2671.6, abs=0.1)
    assert p.largest_acceleration(2.5692) == pytest.approx(259.15, abs=0.01)
    assert p.encoder_step == pytest.approx(1.5503e-6, rel=1e-4)


def test_every_number_says_where_it_comes_from() -> None:
    rows = St3Parameters().described()
    assert len(rows) == len(St3Parameters.model_fields) - 1  # but for `own`
    assert all(source for _, source in rows.values())
    assert rows["encoder_step_um"][0] == pytest.approx(1.5503, abs=1e-4)
    assert "placeholder" in rows["loop_frequency_hz"][1]
    assert "guess" in rows["delay_ms"][1]


def test_a_user_s_own_numbers() -> None:
    table = {"delay_ms": 2, "peak_current_a": 20.0, "provenance": {"delay_ms": "step test of 3 May"}}
    p = load_parameters(table)
    assert (p.delay, p.peak_current, p.loop_frequency) == (2e-3, 20.0, 31.9)
    assert p.own == {"delay": "step test of 3 May", "peak_current": "user's own number, no source given"}
    assert p.described()["delay_ms"] == (2.0, "step test of 3 May")
    assert load_parameters({}) == St3Parameters()
    # what is described can be read again
    again = load_parameters({key: value for key, (value, _) in p.described().items()})
    assert again.model_dump(exclude={"own"}) == pytest.approx(p.model_dump(exclude={"own"}), rel=1e-11)


@pytest.mark.parametrize(
    ("table", "words"),
    [
        ({"delay": 1.0}, "emulator has an unknown key 'delay'; it takes loop_frequency_hz"),
        ({"delay_ms": -1}, "emulator has delay = -0.001: input should be greater than or equal to 0"),
        ({"delay_ms": "2"}, "emulator has delay = '2': input should be a valid number"),
        ({"delay_ms": True}, "emulator has delay = True: input should be a valid number"),
        ({"substeps": 2.5}, r"emulator has substeps = 2.5"),
        ({"switch_distance_mm": 20.0}, "emulator has bumper_distance is 0.01 m; it must be above switch_distance"),
        ({"provenance": {"delay_ms": "x"}}, "emulator has provenance for 'delay_ms', which it does not give"),
        ({"provenance": 3}, "emulator: provenance is 3; it must be a table"),
    ],
)
def test_what_cannot_be_is_one_sentence(table: dict[str, object], words: str) -> None:
    with pytest.raises(ValueError, match=words) as error:
        load_parameters(table)
    assert "\n" not in str(error.value)


def test_what_the_motor_leaves_is_said_where_it_is_less_than_the_capacity() -> None:
    able = St3Parameters().largest_force / 9.81 - St3Parameters().moving_mass
    assert able == pytest.approx(264.6, abs=0.1)
    assert St3Parameters().notes(CAPACITY, able - 0.01) == []
    (note,) = St3Parameters().notes(CAPACITY, 300.0)
    assert note == "with 300 kg on it the motor makes 8.68 m/s2; the capacity says 9.81 m/s2"
    (note,) = St3Parameters(top_speed=0.5).notes(CAPACITY, 0.0)
    assert note == "the drive pushes up to 0.5 m/s; the capacity says 0.664 m/s"
