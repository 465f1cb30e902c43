"""What a recording says of its run, read back as data."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest

from devices.catalogue import find_device
from twin.cli import parser
from twin.commands.run_metadata import answer_times, excitation_metadata, histogram, notes, pulse_data, seeds
from twin.commands.run_words import opening
from twin.errors import InputError
from twin.rehearsal import rehearse
from twin.scene import load_scene, parse_scene

NOTED = """
[block]
width_mm = 60
height_mm = 270
[excitation]
kind = "sine"
amplitude_g = {amplitude}
frequency_hz = 4
[table]
device = "quanser_st3"
seed = 7
[twin]
seed = 11
[notes]
operator = "N. N."
specimen = "oak, edges new"
text = "after the move"
"""


def _scene(amplitude: float = 0.3):
    return parse_scene(NOTED.format(amplitude=amplitude), name="noted", folder=Path())


@pytest.mark.parametrize("amplitude", [0.3, 2.0])
def test_the_excitation_can_be_computed_again_from_what_is_recorded(amplitude: float) -> None:
    """Asked and given, clipped or not; the pieces give the accelerations of the whole motion bit for bit."""
    scene = _scene(amplitude)
    rehearsal = rehearse(scene, find_device("quanser_st3").capacity)
    recorded = excitation_metadata(rehearsal)
    asked, given = json.loads(recorded["asked"]), json.loads(recorded["given"])
    assert asked["type"] == "SineWave"
    assert asked["parameters"] == {"amplitude": amplitude * 9.81, "frequency": 4.0, "cycles": 1.0}
    assert rehearsal.clipped is not None
    assert rehearsal.given is not None
    assert (asked != given) == rehearsal.clipped.changed == (amplitude == 2.0)
    assert given["peak_acceleration_m_s2"] == rehearsal.given.peak_acceleration
    assert np.array_equal(np.array(json.loads(recorded["given_pieces"])), rehearsal.given.pieces)
    rows = np.array(json.loads(recorded["motion_pieces"]))
    times = np.linspace(0.0, rehearsal.motion.duration, 997)[:-1]
    row = rows[np.searchsorted(rows[:, 1], times, side="right")]
    s = times - row[:, 0]
    computed = row[:, 2] + row[:, 3] * s + row[:, 4] * np.sin(row[:, 5] * s + row[:, 6])
    assert computed == pytest.approx(rehearsal.motion.acceleration(times), abs=1e-12)
    phases = json.loads(recorded["motion_phases"])
    assert [phase["name"] for phase in phases] == [phase.name for phase in rehearsal.motion.phases]


def test_nothing_that_shakes_is_said_as_such() -> None:
    rehearsal = rehearse(load_scene("b6l_free"), find_device("quanser_st3").capacity)
    recorded = excitation_metadata(rehearsal)
    assert (json.loads(recorded["asked"]), json.loads(recorded["given_pieces"])) == (None, [])
    assert pulse_data(None) is None


def test_a_pulse_made_of_another_says_both() -> None:
    from excitation import ConstantPulse
    from excitation.reshaped import Ramped

    data = pulse_data(Ramped(ConstantPulse(2.0, 0.5), jerk=20.0))
    assert data is not None
    assert data["parameters"]["jerk"] == 20.0
    assert data["parameters"]["pulse"]["type"] == "ConstantPulse"
    json.dumps(data, allow_nan=False)


def test_notes_of_the_command_line_come_first_and_nothing_is_lost() -> None:
    scene = _scene()
    assert notes(scene, None, None) == {
        "operator": "N. N.",
        "specimen": "oak, edges new",
        "text": "after the move",
    }
    assert notes(scene, "M. M.", "at noon") == {
        "operator": "M. M.",
        "specimen": "oak, edges new",
        "text": "after the move\nat noon",
    }
    assert notes(load_scene("b6l_sine"), None, None) == {}
    assert seeds(scene) == {"emulator": "7", "futures": "11"}


def test_an_unknown_note_is_refused_with_a_hint() -> None:
    with pytest.raises(InputError, match=r"operater.*operator"):
        parse_scene(NOTED.format(amplitude=0.3) + 'operater = "x"', name="noted", folder=Path())


def test_everything_that_explains_a_run_is_in_it() -> None:
    options = parser().parse_args(["run", "--operator", "M. M.", "--note", "at noon"])
    scene = _scene()
    metadata = opening(scene, rehearse(scene, find_device("quanser_st3").capacity), options, {"firmware": "1.2"})
    wanted = {"scene", "excitation", "capacity", "capacity_provenance", "device", "versions", "processor", "seeds"}
    assert wanted | {"notes", "clip"} == set(metadata)
    assert metadata["device"]["firmware"] == "1.2"
    assert metadata["notes"]["operator"] == "M. M."
    assert all(isinstance(value, str) for values in metadata.values() for value in values.values())


def test_a_histogram_counts_everything_once() -> None:
    times = [0.0, 0.9e-6, 1.5e-6, 2e-4, 2e-4, 5.0, math.nan]
    counted = histogram(times)
    edges, counts = json.loads(counted["edges_us"]), json.loads(counted["counts"])
    assert len(edges) == len(counts) + 1
    assert sum(counts) == 6
    assert counts[0] == 3
    assert counts[-1] == 1
    place = next(k for k, count in enumerate(counts) if count == 2)
    assert edges[place] <= 200.0 < edges[place + 1]
    assert set(answer_times({"lateness": times, "sync_to_answer": []})) == {"lateness_histogram"}
