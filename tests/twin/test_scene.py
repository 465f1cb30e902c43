"""Scenes: what ships, what is refused and in which words."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from excitation import ConstantPulse, CosineWave, DoublePulse, SineWave
from twin.errors import InputError
from twin.scene import Scene, load_scene, parse_scene, parse_scene_json, shipped_scenes

GOOD = """
[block]
width_mm = 60
height_mm = 270
[excitation]
kind = "sine"
amplitude_g = 0.3
frequency_hz = 2
[table]
device = "quanser_st3"
"""


def parse(text: str) -> Scene:
    return parse_scene(text, name="mine", folder=Path())


@pytest.mark.parametrize("name", sorted(shipped_scenes()))
def test_every_shipped_scene_loads(name: str) -> None:
    scene = load_scene(name)
    assert scene.name == name
    assert scene.title
    assert parse_scene_json(scene.model_dump_json(), name=name, folder=Path()) == scene


def test_what_ships() -> None:
    assert {"b6l_sine", "b6l_cosine", "b6l_constant", "b6l_free"} <= set(shipped_scenes())
    assert isinstance(load_scene("b6l_sine").pulse(), SineWave)
    assert isinstance(load_scene("b6l_cosine").pulse(), CosineWave)
    assert isinstance(load_scene("b6l_constant").pulse(), ConstantPulse)
    free = load_scene("b6l_free")
    assert free.pulse() is None
    assert math.radians(free.block.initial_rotation_deg) == pytest.approx(0.15, abs=1e-15)


def test_units() -> None:
    scene = parse(GOOD)
    pulse = scene.pulse()
    assert isinstance(pulse, SineWave)
    assert (pulse.amplitude, pulse.frequency) == (0.3 * 9.81, 2.0)
    assert scene.block.block().width == 0.06
    si = parse(GOOD.replace("amplitude_g = 0.3", "amplitude_m_s2 = 1.5")).pulse()
    assert isinstance(si, SineWave)
    assert si.amplitude == 1.5


def test_gravity_is_a_value_of_the_scene() -> None:
    moon = parse(GOOD.replace("height_mm = 270", "height_mm = 270\ngravity_m_s2 = 1.62"))
    pulse = moon.pulse()
    assert isinstance(pulse, SineWave)
    assert pulse.amplitude == 0.3 * 1.62
    assert moon.block.block().gravity == 1.62


def test_double_pulse() -> None:
    text = GOOD.replace('kind = "sine"\namplitude_g = 0.3\nfrequency_hz = 2', "PULSE").replace(
        "PULSE", 'kind = "double_pulse"\npeak_velocity_m_s = 0.3\nstop_gap_mm = 20'
    )
    pulse = parse(text).pulse()
    assert isinstance(pulse, DoublePulse)
    assert pulse.peak_velocity == pytest.approx(0.3)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (("width_mm = 60", "width_mm = 0"), "block.width_mm"),
        (("width_mm = 60", "width_mm = -60"), "block.width_mm"),
        (("width_mm = 60", "width_mm = nan"), "block.width_mm"),
        (("width_mm = 60", "width_mm = inf"), "block.width_mm"),
        (("width_mm = 60", 'width_mm = "60"'), "block.width_mm"),
        (("width_mm = 60", "width_mm = true"), "block.width_mm"),
        (("width_mm = 60\n", ""), "block.width_mm is missing"),
        (("width_mm = 60", "width_cm = 6"), "width_cm is not a key here; did you mean width_mm"),
        (("width_mm = 60", "width_mm = 60\ncolour = 1"), "colour is not a key here"),
        (("amplitude_g", "amplitude_mg"), "amplitude_mg is not a key here; did you mean amplitude_g"),
        (("amplitude_g = 0.3", "amplitude_g = 0.3\namplitude_m_s2 = 3"), "both are given"),
        (("amplitude_g = 0.3\n", ""), "neither is given"),
        (("frequency_hz = 2", "frequency_hz = 0"), "frequency_hz"),
        (('kind = "sine"', 'kind = "sinus"'), "sinus"),
        (('kind = "sine"\n', ""), "kind"),
        (("[table]", "[tabel]"), "tabel is not a key here; did you mean table"),
        (("[block]", "[block"), "no TOML"),
        (("width_mm = 60", "width_mm = 1" + "0" * 400), "block.width_mm"),
    ],
)
def test_refused_in_one_sentence(change: tuple[str, str], words: str) -> None:
    with pytest.raises(InputError) as caught:
        parse(GOOD.replace(*change)).pulse()
    message = str(caught.value)
    assert words in message
    assert message.startswith("scene mine")
    assert "\n" not in message


def test_a_recorded_scene_is_checked_like_any_other() -> None:
    text = parse(GOOD).model_dump_json().replace('"width_mm":60.0', '"width_mm":1e-8')
    with pytest.raises(InputError, match="width"):
        parse_scene_json(text, name="recorded", folder=Path())


def test_standing_still_takes_some_time() -> None:
    text = GOOD.replace('kind = "sine"\namplitude_g = 0.3\nfrequency_hz = 2', 'kind = "none"\nduration_s = 0.001')
    with pytest.raises(InputError, match="duration_s"):
        parse(text)


def test_a_record_that_is_not_there() -> None:
    text = GOOD.replace('kind = "sine"\namplitude_g = 0.3\nfrequency_hz = 2', 'kind = "record"\npath = "nowhere.at2"')
    with pytest.raises(InputError, match=r"cannot read nowhere.at2"):
        parse(text).pulse()


@pytest.mark.parametrize(
    "content", [b"", b"\x00\xff\xfe", b"one\ntwo\nthree\n", b"a\nb\nUNITS OF G\n4 0.01 NPTS, DT\n1 2 3"]
)
def test_a_record_that_is_none(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "bad.at2"
    path.write_bytes(content)
    with pytest.raises(InputError) as caught:
        load_scene("b6l_sine").with_record(path).pulse()
    assert "bad.at2" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_unknown_scene() -> None:
    with pytest.raises(InputError, match=r"no scene named 'b6l_sinus'; did you mean b6l_sine"):
        load_scene("b6l_sinus")
    with pytest.raises(InputError, match=r"cannot read .*nowhere\.toml"):
        load_scene("nowhere.toml")


@given(st.text(max_size=200))
def test_any_text_is_a_scene_or_one_sentence(text: str) -> None:
    for candidate in (text, GOOD + text):
        try:
            parse(candidate)
        except InputError as error:
            assert "\n" not in str(error)  # noqa: PT017 - the sentence is what is tested


@given(
    st.dictionaries(st.sampled_from(["width_mm", "height_mm", "mass_kg", "restitution"]), st.floats() | st.integers())
)
def test_any_numbers_are_a_block_or_one_sentence(values: dict[str, float]) -> None:
    lines = "\n".join(f"{key} = {value!r}" for key, value in values.items())
    try:
        scene = parse(GOOD.replace("width_mm = 60\nheight_mm = 270", lines))
    except InputError as error:
        assert "\n" not in str(error)  # noqa: PT017
    else:
        assert scene.block.block().slenderness > 0.0
