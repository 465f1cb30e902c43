"""Capacities from TOML, and the ones that ship."""

from __future__ import annotations

import pytest

from devices.air_track.capacity import CAPACITY as AIR_TRACK
from devices.capacity_file import load_capacity, load_own_tables
from devices.quanser_st3.capacity import CAPACITY as ST3
from excitation import Capacity

MINE = {"name": "mine", "stroke_mm": 150.0, "velocity_m_s": 0.4, "acceleration_g": 2.0}


def test_st3() -> None:
    numbers = (ST3.name, ST3.stroke, ST3.velocity, ST3.acceleration, ST3.frequency, ST3.payload, ST3.jerk)
    assert numbers == ("quanser_st3", 0.216, 0.664, 9.81, 10.0, 100.0, None)
    assert set(ST3.provenance) == {"stroke", "velocity", "acceleration", "frequency", "payload"}
    assert all("recalled placeholder: replace with your table's data sheet" in t for t in ST3.provenance.values())


def test_air_track() -> None:
    assert (AIR_TRACK.stroke, AIR_TRACK.velocity, AIR_TRACK.one_signed) == (2.0, 1.0, True)
    assert AIR_TRACK.acceleration == pytest.approx(0.6 * 9.81)
    assert AIR_TRACK.kinds is not None
    assert len(AIR_TRACK.kinds) == 1
    assert set(AIR_TRACK.provenance) == {"stroke", "velocity", "acceleration", "kinds", "one_signed"}


def test_a_user_s_own() -> None:
    text = """
    name = "mine"
    stroke_mm = 150
    velocity_m_s = 0.4
    acceleration_m_s2 = 20.0
    jerk_m_s3 = 500.0
    frequency_hz = 12.5
    payload_kg = 7.5
    kinds = ["single sine"]
    [provenance]
    stroke = "data sheet, page 4"
    """
    mine = load_capacity(text)
    assert isinstance(mine, Capacity)
    assert (mine.stroke, mine.acceleration, mine.jerk, mine.frequency) == (0.15, 20.0, 500.0, 12.5)
    assert (mine.payload, mine.kinds, mine.one_signed) == (7.5, ("single sine",), False)
    assert mine.provenance["stroke"] == "data sheet, page 4"
    assert mine.provenance["jerk"] == "user's own number, no source given"
    assert load_capacity(MINE).acceleration == pytest.approx(19.62)


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"stroke_m": 0.1}, "unknown key 'stroke_m'; it takes name, stroke_mm"),
        ({"stroke_mm": None}, "has stroke_mm = None"),
        ({"stroke_mm": 0.0}, "has stroke_mm = 0.0: input should be greater than 0"),
        ({"velocity_m_s": -1.0}, "has velocity_m_s = -1.0"),
        ({"velocity_m_s": float("inf")}, "has velocity_m_s = inf"),
        ({"jerk_m_s3": float("nan")}, "has jerk_m_s3 = nan"),
        ({"stroke_mm": "wide"}, "has stroke_mm = 'wide'"),
        ({"stroke_mm": True}, "has stroke_mm = True"),
        ({"acceleration_m_s2": 3.0}, "one of acceleration_g and acceleration_m_s2"),
        ({"provenance": {"jerk_m_s3": "x"}}, "has provenance for 'jerk_m_s3'; it has stroke, velocity"),
        ({"name": ""}, "has name = ''"),
    ],
)
def test_wrong_files_are_one_sentence(change: dict[str, object], sentence: str) -> None:
    with pytest.raises(ValueError, match=r"^capacity") as error:
        load_capacity(MINE | change)
    assert sentence in str(error.value)
    assert "\n" not in str(error.value)


def test_missing_keys_and_no_toml() -> None:
    with pytest.raises(ValueError, match="has no 'stroke_mm'"):
        load_capacity({k: v for k, v in MINE.items() if k != "stroke_mm"})
    with pytest.raises(ValueError, match="one of acceleration_g"):
        load_capacity({k: v for k, v in MINE.items() if k != "acceleration_g"})
    with pytest.raises(ValueError, match="not TOML"):
        load_capacity("stroke_mm = = 1")


def test_what_stands_beside_the_capacity() -> None:
    text = 'name = "x"\nstroke_mm = 1.0\nvelocity_m_s = 1.0\nacceleration_g = 1.0\n'
    more = '[emulator]\ndelay_ms = 2.0\n[hil]\nboard = "q8_usb"\n'
    assert load_own_tables(text) == {"emulator": {}, "hil": {}}
    assert load_own_tables(text + more) == {"emulator": {"delay_ms": 2.0}, "hil": {"board": "q8_usb"}}
    # nobody's capacity changes with it
    assert load_capacity(text + more) == load_capacity(text)
    with pytest.raises(ValueError, match="capacity has an unknown key 'emulater'"):
        load_own_tables(text + "[emulater]\n")
