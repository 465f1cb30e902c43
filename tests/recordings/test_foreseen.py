"""The foresight a recording holds is made again to the bit, and what cannot be used is one sentence."""

from __future__ import annotations

import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from recordings.errors import RecordingError
from recordings.foreseen import foresight_metadata, foresight_of
from tests.twin.conftest import short_scene
from twin.forecast.loop import TableLoop
from twin.foresight import foresight

SCENE = short_scene()
PIECES = np.array([[0.0, 0.25, 0.0, 0.0, 2.9, 25.0, 0.0], [0.25, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0]])
LOOP = TableLoop(1e-3, 1.0, 27.6, 0.67)


def metadata(until: float | None = None) -> dict[str, dict[str, str]]:
    return {
        "scene": {"name": "short", "json": SCENE.model_dump_json()},
        "excitation": {"motion_pieces": json.dumps(PIECES.tolist())},
        "foresight": foresight_metadata(LOOP, 0.216, 9.81, until),
    }


@pytest.mark.parametrize("until", [None, 0.1])
def test_it_is_the_same_to_the_bit(until: float | None) -> None:
    again, first = foresight_of(metadata(until)), foresight(SCENE, PIECES, 0.216, 9.81, LOOP, until)
    assert again is not None
    for k in range(400):
        a = 2.9 * np.sin(25.0 * 1e-3 * k) if k < 250 else 0.0
        for each in (first, again):
            each.measure(1e-3 * k, a, 1e-4 * (k % 3))
        assert repr(again.estimate) == repr(first.estimate)
        assert repr(again.forecast) == repr(first.forecast)


def test_a_run_without_one_has_none() -> None:
    assert foresight_of({}) is None


@pytest.mark.parametrize(
    ("record", "key", "value"),
    [
        ("foresight", "loop", "{"),
        ("foresight", "loop", '{"damping": -1}'),
        ("foresight", "stroke_m", "wide"),
        ("foresight", "stroke_m", "-1"),
        ("foresight", "acceleration_m_s2", "nan"),
        ("foresight", "stoppable_until_s", "soon"),
        ("foresight", "stoppable_until_s", "-1"),
        ("excitation", "motion_pieces", "[[1, 2]]"),
        ("excitation", "motion_pieces", "[[0, NaN, 0, 0, 0, 0, 0]]"),
        ("excitation", "motion_pieces", "{}"),
        ("excitation", "motion_pieces", "[" * 100_000),
        ("scene", "json", "{}"),
    ],
)
def test_what_cannot_be_used_is_said(record: str, key: str, value: str) -> None:
    spoiled = metadata()
    spoiled[record][key] = value
    with pytest.raises(RecordingError, match="the forecast cannot be made again"):
        foresight_of(spoiled)


@settings(max_examples=60, deadline=None)
@given(
    st.dictionaries(st.sampled_from(["loop", "stroke_m", "acceleration_m_s2"]), st.text(max_size=40), max_size=3),
    st.text(max_size=60),
)
def test_anything_is_one_sentence_or_a_foresight(told: dict[str, str], pieces: str) -> None:
    spoiled = metadata()
    spoiled["foresight"].update(told)
    spoiled["excitation"]["motion_pieces"] = pieces or spoiled["excitation"]["motion_pieces"]
    said = ""
    try:
        foresight_of(spoiled)
    except RecordingError as error:
        said = str(error)
    assert "\n" not in said
