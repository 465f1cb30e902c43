"""What is set on an air track for an asked pulse, and back."""

from __future__ import annotations

import math
from importlib.resources import files

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from devices.air_track.capacity import CAPACITY, MACHINE
from devices.air_track.settings import AirTrackMachine
from devices.capacity_file import load_capacity
from excitation import ConstantPulse, DoublePulse, SineWave, clip

TRACK = CAPACITY.machine
assert isinstance(TRACK, AirTrackMachine)
BLOCK = 2.5692
TEXT = files("devices.air_track").joinpath("capacity.toml").read_text(encoding="utf-8")


def drawn(mass: float, payload: float = BLOCK) -> float:
    """a0 from the forces: mh g - T = mh a, T - M f = M a."""
    moved = TRACK.cart + payload
    return (9.81 * mass - 0.02 * moved) / (moved + mass)


@given(st.sampled_from(TRACK.masses), st.integers(1, 900), st.floats(0.0, 2.0), st.floats(0.0, 30.0))
def test_what_settings_make_is_made_by_the_same_settings(mass, millimetres, coast, payload) -> None:
    a0, drop = drawn(mass, payload), millimetres * 1e-3
    assume(a0 > 1e-3)
    pulse = ConstantPulse(a0, math.sqrt(2.0 * drop / a0))
    assume(clip(pulse, CAPACITY, coast=coast, payload=payload).feasible)
    settings = TRACK.settings_for(pulse, CAPACITY, payload=payload, coast=coast)
    # Other weights may give the same mass; no other mass gives the same acceleration.
    assert settings.mass == pytest.approx(mass, abs=1e-9)
    assert settings.drop == pytest.approx(drop, abs=1e-9)
    assert settings.pulse.amplitude == pytest.approx(a0, rel=1e-9)
    assert settings.pulse.duration == pytest.approx(pulse.duration, rel=1e-9)
    # The start point: the drop, and the way coasted until the bumper or until friction has stopped the cart.
    v = a0 * pulse.duration
    time = min(coast, v / 0.02)
    assert settings.start == pytest.approx(drop + v * time - 0.01 * time**2, rel=1e-9)


@given(st.floats(0.05, 7.0), st.floats(0.01, 1.0), st.floats(0.0, 30.0))
def test_the_nearest_there_is_or_a_sentence(a0, ta, payload) -> None:
    asked = ConstantPulse(a0, ta)
    clipped = clip(asked, CAPACITY, coast=0.5, payload=payload)
    if clipped.given is None:
        assert clipped.limits[0].sentence.count("air_track") == 1
        return
    settings = TRACK.settings_for(clipped.given, CAPACITY, payload=payload, coast=0.5)
    made = settings.pulse
    # Never beyond the capacity, though the asked pulse may lie just at it.
    assert made.amplitude <= CAPACITY.acceleration * (1.0 + 1e-9)
    assert made.final_velocity <= CAPACITY.velocity * (1.0 + 1e-9)
    assert settings.drop <= TRACK.largest_drop * (1.0 + 1e-9)
    assert settings.drop / TRACK.drop_step == pytest.approx(round(settings.drop / TRACK.drop_step), abs=1e-6)
    # Equation (M + mh) a0 = mh g - M f, and d = a0 ta^2 / 2.
    assert made.amplitude == pytest.approx(drawn(settings.mass, payload), rel=1e-12)
    assert made.net_displacement == pytest.approx(settings.drop, rel=1e-12)
    if made.final_velocity < 0.9 * CAPACITY.velocity and made.amplitude < 0.9 * CAPACITY.acceleration:
        others = [abs(drawn(mass, payload) - clipped.given.amplitude) for mass in TRACK.masses]
        assert abs(made.amplitude - clipped.given.amplitude) <= min(others) + 1e-12


def test_the_shipped_pulse() -> None:
    settings = TRACK.settings_for(ConstantPulse(0.26 * 9.81, 0.12), CAPACITY, payload=BLOCK, coast=4.0)
    # By hand: M = 12.5692 kg; 4.45 kg draws it with (43.6545 - 0.251384) / 17.0192 m/s2.
    assert settings.mass == 4.45
    assert settings.pulse.amplitude == pytest.approx(43.403116 / 17.0192, rel=1e-12)
    assert settings.drop == pytest.approx(0.018)
    assert settings.sentence == "hang 4.450 kg, 18.0 mm above its landing; hold the cart 1070.0 mm before the bumper"
    assert settings.numbers == {
        "hanging_mass_kg": 4.45,
        "drop_m": settings.drop,
        "start_before_bumper_m": settings.start,
    }


@pytest.mark.parametrize(
    ("pulse", "payload", "sentence"),
    [
        (
            ConstantPulse(2.0, 1e-3),
            BLOCK,
            "constant pulse asks a drop of 1e-06 m; air_track sets it in steps of 0.001 m",
        ),
        (ConstantPulse(0.3, 3.0), BLOCK, "constant pulse asks a drop of 1.35 m; air_track has 0.9 m"),
        (
            ConstantPulse(5.8, 0.1),
            20.0,
            "constant pulse asks 5.8 m/s2; air_track's weights, 21.05 kg in all, draw 30 kg of cart and block with "
            "4.033 m/s2",
        ),
        (
            ConstantPulse(0.01, 1.0),
            BLOCK,
            "constant pulse asks 0.01 m/s2; air_track's lightest weight, 0.05 kg, would draw 12.57 kg of cart and "
            "block with 0.01895 m/s2",
        ),
    ],
)
def test_what_cannot_be_set_is_one_sentence(pulse, payload, sentence) -> None:
    clipped = clip(pulse, CAPACITY, payload=payload)
    assert clipped.given is None
    assert clipped.limits[0].sentence == sentence
    with pytest.raises(ValueError, match=r"air_track") as caught:
        TRACK.settings_for(pulse, CAPACITY, payload=payload, coast=0.0)
    assert str(caught.value) == sentence


def test_the_mass_of_the_block_must_be_known() -> None:
    with pytest.raises(ValueError, match="air_track draws the block along: its mass must be given"):
        TRACK.settings_for(ConstantPulse(2.0, 0.1), CAPACITY, payload=None, coast=0.0)


@pytest.mark.parametrize(
    "pulse", [SineWave(2.0, 3.0), DoublePulse(0.5, 0.1, pulse_acceleration=5.0), ConstantPulse(-2.0, 0.1)]
)
def test_other_kinds_and_the_other_sense_are_refused_with_a_suggestion(pulse) -> None:
    clipped = clip(pulse, CAPACITY, payload=BLOCK)
    assert clipped.given is None
    assert isinstance(clipped.suggestion, ConstantPulse)
    assert clip(clipped.suggestion, CAPACITY, payload=BLOCK).feasible


def test_the_track_is_too_short_for_a_long_coast() -> None:
    clipped = clip(ConstantPulse(2.5, 0.12), CAPACITY, coast=12.0, payload=BLOCK)
    assert clipped.limits[0].name == "stroke"
    assert clipped.given is not None
    assert clipped.factor < 1.0


def test_gravity_is_the_scenes() -> None:
    moon = TRACK.in_gravity(1.62)
    assert moon.acceleration(4.45, BLOCK) == pytest.approx((4.45 * 1.62 - 12.5692 * 0.02) / 17.0192)
    assert moon.masses == TRACK.masses


def test_a_users_own_file() -> None:
    own = TEXT.replace("cart_kg = 10.0", "cart_kg = 5.5").replace('"air_track"', '"ours"')
    machine = load_capacity(own, MACHINE).machine
    assert isinstance(machine, AirTrackMachine)
    assert machine.cart == 5.5
    assert machine.weights == TRACK.weights


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (("cart_kg = 10.0", "cart_kg = -1.0"), "machine of air_track has cart_kg = -1.0: .*above 0 kg"),
        (("cart_kg = 10.0", "cart = 10.0"), "machine of air_track has no 'cart_kg'"),
        (
            ("drop_step_m = 0.001", "drop_step_m = 0.001\ncolour = 1"),
            "machine of air_track has an unknown key 'colour'",
        ),
        (("weights_kg = [0.05,", "weights_kg = [nan,"), "weights_kg.0 = nan: .*must be finite"),
        (('shape = "half sine"', 'shape = "square"'), "end_stop.shape = 'square'"),
        (('cart_kg = "', 'speed = "'), "provenance names 'speed'"),
    ],
)
def test_a_wrong_file_is_one_sentence(change, sentence) -> None:
    with pytest.raises(ValueError, match=sentence):
        load_capacity(TEXT.replace(*change), MACHINE)


def test_a_file_without_a_machine_is_none_of_an_air_track() -> None:
    bare = TEXT.split("[machine]")[0]
    with pytest.raises(ValueError, match=r"capacity of air_track has no table \[machine\]"):
        load_capacity(bare, MACHINE)
    with pytest.raises(ValueError, match=r"has a table \[machine\], which is for others"):
        load_capacity(TEXT)
