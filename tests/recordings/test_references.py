"""The regression test: recordings of this code, made once, are read by every later version and predicted the same.

Where a change of the twin is meant to change predictions, `python -m tests.recordings.make_recordings` makes them anew.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from recordings import read_run
from recordings.replay import LARGEST_DIFFERENCE, replay
from recordings.samples import DESCRIPTIONS, sample_names, sample_path
from tests.recordings.make_recordings import REFERENCES, SAMPLES
from twin.commands.recording import live_twin, scene_in

DATA = Path(__file__).parent / "data"
FILES = [*(DATA / f"reference_{name}.mcap" for name in REFERENCES), *(sample_path(name) for name in sample_names())]


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_it_is_read_and_predicted_as_when_it_was_made(path: Path) -> None:
    run = read_run(path)
    assert run.complete, run.problems
    assert len(run.cycles) >= 300
    again = replay(run, live_twin(scene_in(run)))
    assert again.played == len(run.cycles)
    assert again.largest_change <= LARGEST_DIFFERENCE, (
        f"{path.name} is predicted otherwise by {again.largest_change:g} rad; if that is meant, make it anew: "
        "python -m tests.recordings.make_recordings"
    )
    # Something is predicted: a reference of a block that never moves would prove nothing.
    assert again.predicted_peak > 0.01
    assert len([event for event in again.events if event.name == "impact"]) >= 1


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_a_twin_that_changed_is_noticed(path: Path) -> None:
    run = read_run(path)
    scene = scene_in(run)
    block = scene.block.model_copy(update={"height_mm": scene.block.height_mm * (1.0 + 1e-6)})
    again = replay(run, live_twin(scene.model_copy(update={"block": block})))
    assert again.largest_change > LARGEST_DIFFERENCE


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_the_events_are_those_of_the_prediction(path: Path) -> None:
    run = read_run(path)
    again = replay(run, live_twin(scene_in(run)))
    written = [(event.name, event.time) for event in run.events if event.message.startswith("predicted: ")]
    assert [name for name, _ in written] == [event.name for event in again.events]
    np.testing.assert_allclose([time for _, time in written], [event.time for event in again.events], atol=1e-6)


def test_they_are_small() -> None:
    assert all((DATA / f"reference_{name}.mcap").stat().st_size < 100_000 for name in REFERENCES)
    assert all(sample_path(name).stat().st_size < 300_000 for name in sample_names())


def test_every_sample_is_made_by_the_script() -> None:
    assert set(SAMPLES) == set(DESCRIPTIONS)
    assert {path.name for path in sample_path("sine").parent.glob("*.mcap")} == {f"{name}.mcap" for name in SAMPLES}


def test_the_samples_show_what_they_say() -> None:
    ends = {name: read_run(sample_path(name)).metadata["result"] for name in sample_names()}
    assert {name: result["predicted"] for name, result in ends.items()} == {
        "sine": "rocked",
        "free": "rocked",
        "fall": "overturned",
    }
    assert all(result["predicted"] == result["measured"] for result in ends.values())
