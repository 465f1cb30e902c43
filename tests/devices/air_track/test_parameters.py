"""The emulated air track's own numbers, and a user's."""

from __future__ import annotations

import pytest

from devices.air_track.capacity import CAPACITY
from devices.air_track.parameters import AirTrackParameters, load_parameters
from devices.quanser_st3.capacity import CAPACITY as ST3
from devices.roori1.parameters import load_parameters as load_roori1_parameters


@pytest.mark.parametrize("load", [load_parameters, load_roori1_parameters])
def test_a_users_own_numbers(load) -> None:
    own = load({"release_delay_ms": 4.5, "encoder_step_um": 5, "provenance": {"release_delay_ms": "scope, 3 May"}})
    assert (own.release_delay, own.encoder_step) == pytest.approx((4.5e-3, 5e-6))
    assert own.source("release_delay") == "scope, 3 May"
    assert own.source("accelerometer_bias") == "a guess: take your data sheet's"
    assert own.described()["release_delay_ms"] == (4.5, "scope, 3 May")


@pytest.mark.parametrize(
    ("table", "words"),
    [
        ({"delay_ms": 1.0}, "emulator has an unknown key 'delay_ms'; it takes encoder_step_um"),
        ({"release_delay_ms": -1.0}, "emulator has release_delay = -0.001"),
        ({"accelerometer_range_m_s2": 0.0}, "emulator has accelerometer_range = 0.0"),
    ],
)
def test_wrong_numbers_are_one_sentence(table, words: str) -> None:
    with pytest.raises(ValueError, match=words):
        load_parameters(table)


def test_a_block_that_is_not_light_beside_the_cart_is_said() -> None:
    parameters = AirTrackParameters()
    assert parameters.notes(CAPACITY, 0.4) == []
    (note,) = parameters.notes(CAPACITY, 2.5692)
    assert note.startswith("the block, 2.5692 kg, is not light beside the cart, 10 kg")
    assert parameters.notes(ST3, 99.0) == []
