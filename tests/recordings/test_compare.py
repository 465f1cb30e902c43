"""Comparison of two runs made of exact solutions: what differs is known."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest

from recordings import Geometry, RecordingError, read_run
from recordings.compare import Side, compare, has_rotation, side_of
from recordings.compare_picture import draw_comparison
from recordings.compare_words import data, energy_lost, inertia, lines
from recordings.rewrite import Contents, write_recording
from recordings.run import Cycles, Run
from tests.facts import B6L
from twin.rocking.response import Response
from twin.simulation import simulate

NOISE = 2e-4
FREE = simulate(B6L, initial_rotation=0.15)
OTHER_RATIO = 0.98 * B6L.housner_restitution
OTHER = simulate(B6L, initial_rotation=0.15, restitution=OTHER_RATIO)


def recorded(
    path: Path,
    measured: Response | None,
    predicted: Response,
    *,
    later: float = 0.0,
    rate: float = 1000.0,
    seed: int = 0,
) -> Run:
    """Record a run whose rotations are those of two exact solutions, the measured one noisy, `later` on its clock."""
    count = int(5.0 * rate)
    time = np.arange(count) / rate
    inside = time >= later
    then = np.maximum(time - later, 0.0)
    noise = NOISE * np.random.default_rng(seed).standard_normal(count)
    blank = np.full(count, np.nan)
    held = 0.15

    def rotation(response: Response) -> np.ndarray:
        return np.where(inside, response.rotation(then), held)

    cycles = Cycles(
        cycle=np.arange(count),
        time=time,
        host_time_ns=np.arange(count) * 1_000_000,
        lateness=np.zeros(count),
        target_position=np.zeros(count),
        position=np.zeros(count),
        acceleration=np.zeros(count),
        rotation=blank if measured is None else rotation(measured) + noise,
        predicted_rotation=rotation(predicted),
        predicted_angular_velocity=np.where(inside, predicted.angular_velocity(then), 0.0),
        status=np.zeros(count, dtype=np.int64),
    )
    write_recording(Contents({}, Geometry(0.06, 0.27), cycles, (), ()), path)
    return read_run(path)


def sides(run: Run) -> tuple[Side, Side]:
    return side_of(run, "measured", "measured"), side_of(run, "predicted", "predicted")


def test_a_prediction_that_is_right_differs_by_the_noise(tmp_path: Path) -> None:
    found = compare(*sides(recorded(tmp_path / "a.mcap", FREE, FREE)), shift=0.0)
    assert found.rms == pytest.approx(NOISE, rel=0.05)
    assert found.peak_difference < 6.0 * NOISE
    assert found.compared == 5000
    assert abs(found.estimated.seconds) < 2e-4
    pairs = found.matches
    assert pairs.first.size >= 25
    late = found.second.impacts.time[pairs.second] - found.first.impacts.time[pairs.first]
    assert np.max(np.abs(late[:20])) < 1e-3


def test_the_difference_is_that_of_the_solutions(tmp_path: Path) -> None:
    found = compare(*sides(recorded(tmp_path / "a.mcap", FREE, OTHER)), shift=0.0)
    time = np.arange(5000) / 1000.0
    true = OTHER.rotation(time) - FREE.rotation(time)
    assert found.rms == pytest.approx(float(np.sqrt(np.mean(true**2))), rel=1e-2)
    assert found.peak_difference == pytest.approx(float(np.max(np.abs(true))), abs=5.0 * NOISE)
    for side, ratio in ((found.first, B6L.housner_restitution), (found.second, OTHER_RATIO)):
        mean, error = side.restitution
        assert mean == pytest.approx(ratio, abs=max(4.0 * error, 1e-3))
        assert error < 0.01


def test_two_recordings_are_brought_together(tmp_path: Path) -> None:
    one = recorded(tmp_path / "one.mcap", FREE, FREE, later=0.2)
    two = recorded(tmp_path / "two.mcap", FREE, FREE, later=0.7437, rate=500.0, seed=1)
    found = compare(side_of(one, "measured", "one"), side_of(two, "measured", "two"))
    assert found.shift == pytest.approx(0.5437, abs=3e-4)
    assert found.rms == pytest.approx(math.sqrt(2.0) * NOISE, rel=0.25)
    assert found.matches.first.size >= 23
    assert np.all(np.isnan(found.difference[one.cycles.time > 4.998 - found.shift]))


def test_energy_is_what_the_block_loses(tmp_path: Path) -> None:
    side = side_of(recorded(tmp_path / "a.mcap", None, FREE), "predicted", "predicted")
    moment, unit = inertia(B6L)
    assert unit == "J"
    lost, _ = energy_lost(side, moment)
    # All of it in the end: m g R (cos(alpha - theta0) - cos(alpha)), the height the centre came down.
    alpha, mass = B6L.slenderness, B6L.mass
    assert mass is not None
    whole = mass * B6L.gravity * B6L.half_diagonal * (math.cos(alpha - 0.15) - math.cos(alpha))
    assert float(np.nansum(lost)) == pytest.approx(whole, rel=2e-3)
    for k in range(5):
        before = FREE.impact_rates[k]
        assert lost[k] == pytest.approx(0.5 * moment * before**2 * (1.0 - B6L.housner_restitution**2), rel=5e-3)


def test_a_fallen_block_is_compared_while_it_stands(tmp_path: Path) -> None:
    fallen = simulate(B6L, initial_rotation=0.2, initial_angular_velocity=0.5)
    assert fallen.overturning_time is not None
    found = compare(*sides(recorded(tmp_path / "a.mcap", fallen, fallen)), shift=0.0)
    assert found.first.overturned
    assert found.second.overturned
    assert found.compared <= fallen.overturning_time * 1000.0
    assert found.rms == pytest.approx(NOISE, rel=0.1)


def test_words_data_and_picture(tmp_path: Path) -> None:
    found = compare(*sides(recorded(tmp_path / "a.mcap", FREE, OTHER)), shift=0.0)
    text = "\n".join(lines(found, B6L))
    assert "restitution" in text
    assert "Housner's for this block: 0.9294" in text
    said = json.loads(json.dumps(data(found, B6L), allow_nan=False))
    assert said["energy_unit"] == "J"
    assert len(said["first"]["impacts"]) == len(found.first.impacts)
    assert said["matched"][0] == [0, 0]
    for name in ("a.png", "b.svg"):
        draw_comparison(found, tmp_path / "new" / name, B6L)
        assert (tmp_path / "new" / name).stat().st_size > 10_000
    with pytest.raises(RecordingError, match=r"a picture ends in \.png, \.svg or \.pdf"):
        draw_comparison(found, tmp_path / "a.xyz", None)


def test_nothing_to_compare_is_said(tmp_path: Path) -> None:
    run = recorded(tmp_path / "a.mcap", None, FREE)
    assert not has_rotation(run, "measured")
    with pytest.raises(RecordingError, match="has no measured rotation to compare"):
        side_of(run, "measured", "measured")
    side = side_of(run, "predicted", "predicted")
    apart = compare(side, side, shift=100.0)
    assert apart.compared == 0
    assert "do not overlap" in "\n".join(lines(apart, None))
    json.dumps(data(apart, None), allow_nan=False)
