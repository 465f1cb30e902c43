"""The kept command: what it is for, that nothing else gets it, and how it is laid into a later run."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest

from excitation import Capacity, ConstantPulse, Motion, Pulse, SineWave
from twin.errors import InputError
from twin.live import set_points
from twin.tuned import Errors, Purpose, TunedCommand, pauses, purpose_of
from twin.tuned_folder import find, keep, path_of, read

H = 1e-3
SINE = SineWave(2.943, 4.0)
BENCH = Capacity(name="bench", stroke=0.2, velocity=0.6, acceleration=9.81, provenance={"stroke": "measured"})


def run_of(pulse: Pulse = SINE, **options) -> Motion:
    return Motion(pulse, options.pop("positioning", 1.09), brake=1.09, settle=options.pop("settle", 1.0), **options)


def purpose(motion: Motion | None = None, **changes) -> Purpose:
    given = {"device": "bench", "capacity": BENCH, "cycle_time": H, "payload": 2.5, "emulator": "numbers"} | changes
    return purpose_of(motion=motion or run_of(), **given)


def bump(t: np.ndarray) -> np.ndarray:
    """A correction from -0.2 to 0.5 s about the start of the pulse, smooth and 0 at both ends; m."""
    s = (t + 0.2) / 0.7
    return np.where((s > 0.0) & (s < 1.0), 1e-3 * np.sin(math.pi * np.clip(s, 0.0, 1.0)) ** 4 * np.cos(60.0 * t), 0.0)


def command(**changes) -> TunedCommand:
    grid = -0.2004 + H * np.arange(702)
    values = {
        "purpose": purpose(),
        "scene": "mine",
        "excitation": "single sine",
        "payload": 2.5,
        "identity": "",
        "made": "2026-11-21T12:00:00Z",
        "reason": "converged",
        "corrections": 4,
        "runs": 18,
        "asked_peak": 2.943,
        "before": Errors(rms=0.12, peak=0.22, noise=0.004),
        "after": Errors(rms=0.006, peak=0.03, noise=0.004),
        "start": -0.2004,
        "correction": tuple(bump(grid).tolist()),
        "achieved_before": (0.0,) * 702,
        "achieved": (0.1,) * 702,
    }
    return TunedCommand(**{**values, **changes})


def test_what_is_read_is_what_was_kept(tmp_path: Path) -> None:
    kept = command()
    path = keep(tmp_path, kept)
    assert path == path_of(tmp_path, kept.purpose)
    assert path.parent == tmp_path / "bench"
    assert read(path) == kept
    found = find(tmp_path, purpose())
    assert found.command == kept
    assert found.passed_over == ()
    assert [p.name for p in path.parent.iterdir()] == [path.name]
    # A second one takes its place.
    assert read(keep(tmp_path, command(corrections=5))).corrections == 5


def test_the_run_around_the_pulse_does_not_matter() -> None:
    same = (run_of(), run_of(settle=0.3), run_of(wait=7.0), run_of(positioning=0.4))
    assert {purpose(motion).key for motion in same} == {purpose().key}


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"motion": run_of(SineWave(2.9430001, 4.0))}, None),
        ({"motion": run_of(SineWave(2.943, 4.0, 2.0))}, None),
        ({"motion": run_of(SINE.scaled(-1.0))}, None),
        ({"capacity": BENCH.model_copy(update={"stroke": 0.21})}, "capacity"),
        ({"capacity": BENCH.model_copy(update={"name": "other"})}, "capacity"),
        ({"cycle_time": 2e-3}, "cycle time"),
        ({"payload": 2.6}, "payload"),
        ({"payload": None}, "payload"),
        ({"emulator": None}, "machine, set of the emulator's numbers"),
        ({"emulator": "other numbers"}, "set of the emulator's numbers"),
    ],
)
def test_nothing_else_gets_it(changes: dict, said: str | None, tmp_path: Path) -> None:
    path = keep(tmp_path, command())
    asked = purpose(**changes)
    found = find(tmp_path, asked)
    assert found.command is None
    # Of the same pulse it is said why it is not used.
    assert found.passed_over == (() if said is None else (f"{path.name} is for another {said}",))


def test_another_device_has_a_folder_of_its_own(tmp_path: Path) -> None:
    keep(tmp_path, command())
    assert find(tmp_path, purpose(device="other")).command is None


def test_where_a_number_comes_from_does_not_matter() -> None:
    assert purpose(capacity=BENCH.model_copy(update={"provenance": {}})).key == purpose().key


def test_a_constant_pulse_is_tuned_with_its_coast_and_brake() -> None:
    pulse = ConstantPulse(2.0, 0.1)
    runs = [Motion(pulse, 1.0, brake=brake, coast=coast) for brake, coast in ((1.0, 0.0), (1.2, 0.0), (1.0, 0.1))]
    assert len({purpose(motion).key for motion in runs}) == 3


@pytest.mark.parametrize("settle", [1.0, 1.0003, 0.61237])
def test_a_run_whose_cycles_lie_otherwise_gets_the_same_correction(settle: float) -> None:
    motion = run_of(settle=settle)
    positions = set_points(motion, 0.5, H)
    change = command().corrected(positions, motion) - positions
    t = np.arange(1, positions.size + 1) * H - motion.pulse_start
    # Cubic between samples of 1 ms: (60 rad/s * 1 ms)^4 of it and less.
    assert change == pytest.approx(bump(t), abs=2e-9)
    assert np.max(np.abs(change)) > 0.9e-3


def test_a_run_with_too_short_a_pause_is_refused() -> None:
    motion = run_of(settle=0.1)
    assert pauses(motion) == pytest.approx((0.1, 0.1))
    with pytest.raises(InputError, match=r"takes 0\.200 s before the pulse, where this run pauses for 0\.100 s"):
        command().corrected(set_points(motion, 0.0, H), motion)
    late = run_of(settle=0.22)
    with pytest.raises(InputError, match=r"0\.251 s behind the pulse, where this run pauses for 0\.220 s"):
        command().corrected(set_points(late, 0.0, H), late)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"version": 2}, "version"),
        ({"start": 0.1}, "start"),
        ({"correction": [0.0]}, "correction"),
        ({"correction": [0.0, float("nan")]}, "correction"),
        ({"correction": "os.system"}, "correction"),
        ({"achieved": [0.0, 0.0]}, "differ in length"),
        ({"surprise": 1}, "surprise is not a key here"),
        ({"after": {"rms": -1.0, "peak": 0.1, "noise": 0.0}}, "after.rms"),
    ],
)
def test_a_file_that_makes_no_sense_is_one_sentence(change: dict, words: str, tmp_path: Path) -> None:
    path = keep(tmp_path, command())
    path.write_text(json.dumps({**json.loads(path.read_text()), **change}))
    with pytest.raises(InputError, match=words) as refused:
        find(tmp_path, purpose())
    assert "\n" not in str(refused.value)
    assert str(path) in str(refused.value)


def test_a_file_that_makes_no_sense_beside_it_is_said(tmp_path: Path) -> None:
    folder = keep(tmp_path, command()).parent
    (folder / "old.json").write_text("{}")
    assert find(tmp_path, purpose()).passed_over == ()
    assert find(tmp_path, purpose(cycle_time=2e-3)).passed_over[-1] == "old.json cannot be read"


def test_a_file_under_another_name_is_not_taken_for_what_it_is_not(tmp_path: Path) -> None:
    path = keep(tmp_path, command())
    path.rename(path_of(tmp_path, purpose(cycle_time=2e-3)))
    with pytest.raises(InputError, match="was made for another cycle time"):
        find(tmp_path, purpose(cycle_time=2e-3))


def test_a_huge_correction_is_none() -> None:
    wild = command(correction=(0.0, *(5.0 for _ in range(700)), 0.0))
    with pytest.raises(InputError, match="a correction of 5 m is none"):
        wild.corrected(set_points(run_of(), 0.0, H), run_of())


def test_a_folder_that_cannot_be_written(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="cannot be kept"):
        keep(tmp_path / "file", command())


def test_errors_in_words() -> None:
    assert str(Errors(rms=0.1, peak=0.2, noise=0.0)) == "10.00% rms, 20.0% at most"
    assert str(Errors(rms=0.0061, peak=0.026, noise=0.0045)) == "0.61% rms (noise 0.45%), 2.6% at most"
