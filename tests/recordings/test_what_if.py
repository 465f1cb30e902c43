"""What a change does to a prediction, and a recording of it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from recordings import RecordingError, read_run
from recordings.replay import replay
from recordings.rewrite import Contents, own_metadata, with_predicted, write_recording
from recordings.run import Run
from recordings.samples import sample_path
from recordings.what_if import differences, prediction_of
from twin.commands.recording import live_twin, scene_in
from twin.live_twin import LiveTwin


@pytest.fixture(scope="module")
def run() -> Run:
    return read_run(sample_path("free"))


def twin_of(run: Run, restitution: float | None = None, tilt: float = 1.0) -> LiveTwin:
    scene = scene_in(run)
    block = scene.block.block()
    return LiveTwin(block, restitution, tilt * np.radians(scene.block.initial_rotation_deg))


def test_nothing_changed_is_no_difference(run: Run) -> None:
    before = prediction_of(replay(run, live_twin(scene_in(run))), run.cycles)
    found = differences(before, before)
    assert (found.rms, found.largest) == (0.0, 0.0)
    assert found.same_impacts == len(before.impacts) > 50


def test_less_restitution_is_less_motion_and_earlier_impacts(run: Run) -> None:
    before = prediction_of(replay(run, twin_of(run)), run.cycles)
    after = prediction_of(replay(run, twin_of(run, restitution=0.8)), run.cycles)
    found = differences(before, after)
    assert before.outcome == after.outcome == "rocked"
    # Until the first impact nothing has changed, and its time neither.
    first = before.impacts[0].time
    assert after.impacts[0].time == pytest.approx(first, abs=1e-9)
    assert found.largest_time > first
    assert found.same_impacts > 20
    assert all(now.time < then.time for then, now in zip(before.impacts[1:20], after.impacts[1:20], strict=True))
    both = np.abs(after.rotation - before.rotation)
    assert found.largest == pytest.approx(np.max(both))
    assert found.rms == pytest.approx(np.sqrt(np.mean(both**2)))


def test_impacts_are_the_same_while_they_go_the_same_way(run: Run) -> None:
    before = prediction_of(replay(run, twin_of(run)), run.cycles)
    mirrored = prediction_of(replay(run, twin_of(run, tilt=-1.0)), run.cycles)
    assert differences(before, mirrored).same_impacts == 0


def test_outcomes(run: Run) -> None:
    assert prediction_of(replay(run, twin_of(run, tilt=3.0)), run.cycles).outcome == "overturned"
    assert prediction_of(replay(run, twin_of(run, tilt=0.0)), run.cycles).outcome == "stayed"


def test_a_recording_of_it_is_one_like_any_other(run: Run, tmp_path: Path) -> None:
    again = replay(run, twin_of(run))
    metadata = {**own_metadata(run.metadata), "what_if": {"set": "nothing"}}
    assert not {"schema", "clock", "geometry", "recorder"} & set(metadata)
    events = with_predicted(run.events, again.events, run.cycles)
    path = tmp_path / "other.mcap"
    write_recording(Contents(metadata, run.geometry, run.cycles, events, run.missed), path)
    back = read_run(path)
    assert back.complete
    assert back.metadata["scene"] == run.metadata["scene"]
    assert back.geometry == run.geometry
    for name in ("time", "acceleration", "rotation", "predicted_rotation", "host_time_ns", "status"):
        assert np.array_equal(getattr(back.cycles, name), getattr(run.cycles, name))
    assert [(event.name, event.message) for event in back.events] == [
        (event.name, event.message) for event in run.events
    ]
    np.testing.assert_allclose([e.time for e in back.events], [e.time for e in run.events], atol=1e-9)
    with pytest.raises(RecordingError, match="exists already and is not overwritten"):
        write_recording(Contents(metadata, run.geometry, run.cycles, events, run.missed), path)


def test_events_of_the_prediction_are_replaced_and_others_kept(run: Run) -> None:
    events = with_predicted(run.events, (), run.cycles)
    assert events
    assert {event.name for event in events} == {"phase", "advice"}
