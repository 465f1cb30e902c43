"""A block from outcomes alone: the likelihood against `overturns`, a cheap fit, and what it says against itself."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from excitation import CosineWave, SineWave
from tests.facts import B6L, LIMIT, P
from twin.calibration.outcomes import Effort, OutcomeFit, Trial, fit_outcomes, outcome_lines
from twin.calibration.outcomes.agreement import agreement_of
from twin.calibration.outcomes.fit import HIGHEST, LOWEST
from twin.calibration.outcomes.likelihood import WRONG, Likelihood, levels, table_of
from twin.calibration.outcomes.mixing import mixing_of
from twin.calibration.outcomes.picture import draw_outcomes
from twin.errors import InputError
from twin.rocking.block import Block
from twin.rocking.run import parameters
from twin.simulation import overturns

ETA = B6L.housner_restitution
TRUTH = np.array([B6L.slenderness, math.log(P), ETA, math.log(1e-3)])
CHEAP = Effort(starts=256, walkers=12, search=15, burnt=20, kept=40)


def cosines(count: int) -> list[Trial]:
    """Return exact single-cosine trials of B6L."""
    rng = np.random.default_rng(5)
    trials: list[Trial] = []
    for _ in range(count):
        w = rng.uniform(1.0, 6.0)
        amplitude, frequency = rng.uniform(1.0, 2.0 + w) * LIMIT, w * P / (2.0 * math.pi)
        fell = overturns(parameters(B6L, ETA), CosineWave(amplitude, frequency).pieces)
        trials.append(Trial("cosine", amplitude, frequency, fell is True))
    return trials


@pytest.fixture(scope="module")
def fit() -> OutcomeFit:
    return fit_outcomes(cosines(80), seed=3, effort=CHEAP)


def test_the_likelihood_is_that_of_each_amplitude_followed_by_itself() -> None:
    trials = [*cosines(12), Trial("sine", -1.6 * LIMIT, 2.0, True, 2.0)]
    points = np.array([TRUTH, [0.2, math.log(6.0), 0.8, math.log(0.1)], [0.25, math.log(8.0), 0.97, math.log(0.05)]])
    found = Likelihood(trials, 9.81, LOWEST, HIGHEST)(points)
    for point, answer in zip(points, found, strict=True):
        alpha, p, eta, spread = point[0], math.exp(point[1]), point[2], math.exp(point[3])
        diagonal = 1.5 * 9.81 / p**2
        body = parameters(Block(diagonal * math.sin(alpha), diagonal * math.cos(alpha)), eta)
        total = 0.0
        for trial in trials:
            kind = SineWave if trial.kind == "sine" else CosineWave
            fell = [
                overturns(body, kind(trial.amplitude * math.exp(spread * z), trial.frequency, trial.cycles).pieces)
                for z in levels()
            ]
            first = fell[: len(fell) // 2]
            asked = first if len(set(first)) == 1 else fell
            falls = WRONG + (1.0 - 2.0 * WRONG) * asked.count(True) / len(asked)
            total += math.log(falls if trial.overturned else 1.0 - falls)
        assert answer == pytest.approx(total, abs=1e-9)


def test_outside_its_box_a_block_is_impossible() -> None:
    likelihood = Likelihood(cosines(10), 9.81, LOWEST, HIGHEST)
    outside = np.tile(TRUTH, (4, 1))
    outside[0, 0] = 1.3
    outside[1, 2] = -0.1
    outside[2, 3] = -20.0
    assert np.isneginf(likelihood(outside)[:3]).all()
    assert np.isfinite(likelihood(outside)[3])


def test_equal_trials_are_asked_once() -> None:
    trial = Trial("sine", 3.0, 2.0, True)
    table = table_of([trial, replace(trial, overturned=False), trial, replace(trial, amplitude=-3.0)])
    assert table.tolist() == [[3.0, 2.0, 1.0, 0.0, 3.0, 1.0]]


def test_a_cheap_fit_finds_the_block(fit: OutcomeFit) -> None:
    assert fit.alpha.low < B6L.slenderness < fit.alpha.high
    assert fit.p.low < P < fit.p.high
    assert fit.eta.low < ETA < fit.eta.high
    assert fit.alpha.best == pytest.approx(B6L.slenderness, rel=0.2)
    assert fit.p.best == pytest.approx(P, rel=0.2)
    assert fit.correlations[0, 1] > 0.0  # alpha and p trade off
    assert fit.agreement.share > 0.05


def test_the_same_seed_gives_the_same_fit() -> None:
    trials, effort = cosines(20), Effort(starts=32, walkers=10, search=2, burnt=2, kept=4)
    first, second, other = (fit_outcomes(trials, seed=seed, effort=effort) for seed in (1, 1, 2))
    assert np.array_equal(first.points, second.points)
    assert first.as_data() == second.as_data()
    assert not np.array_equal(first.points, other.points)


def test_words_data_and_picture(fit: OutcomeFit, tmp_path: Path) -> None:
    lines = outcome_lines(fit)
    assert lines[0].startswith("trials     80, of which ")
    assert all(line[10] == " " for line in lines)
    data = json.loads(json.dumps(fit.as_data(), allow_nan=False))
    assert data["estimates"]["p"]["maximum_likelihood"] == fit.p.best
    draw_outcomes(fit, tmp_path / "folder" / "fit.png")
    assert (tmp_path / "folder" / "fit.png").read_bytes().startswith(b"\x89PNG")
    with pytest.raises(InputError, match="a picture ends in"):
        draw_outcomes(fit, tmp_path / "fit.gif2")


@pytest.mark.parametrize(
    ("trials", "words"),
    [
        (cosines(5), "5 trials are too few to estimate a block; 10 are needed"),
        ([Trial("sine", 9.0, 1.0, True)] * 12, "every one of the 12 trials fell"),
        ([Trial("sine", 0.1, 1.0, False)] * 12, "every one of the 12 trials stood"),
    ],
)
def test_what_no_block_can_be_told_from(trials: list[Trial], words: str) -> None:
    with pytest.raises(InputError, match=words):
        fit_outcomes(trials)


def test_chains_that_agree_have_mixed_and_others_have_not() -> None:
    rng = np.random.default_rng(1)
    points = rng.standard_normal((2, 200, 12, 4))
    mixing = mixing_of(points)
    assert mixing.fault is None
    assert max(mixing.ratios) < 1.01
    assert mixing.draws == pytest.approx(2 * 200 * 12, rel=0.25)
    points[1, ..., 2] += 2.0
    assert "disagree about eta" in str(mixing_of(points).fault)
    stuck = np.broadcast_to(rng.standard_normal((2, 1, 12, 4)), (2, 200, 12, 4)).copy()
    stuck[1] = stuck[0]
    assert "independent draws; 100 are needed" in str(mixing_of(stuck).fault)


def test_the_time_of_forgetting_is_that_of_a_known_process() -> None:
    rng, memory = np.random.default_rng(2), 0.8
    chain = np.zeros((2, 4000, 10, 4))
    for step in range(1, chain.shape[1]):
        chain[:, step] = memory * chain[:, step - 1] + rng.standard_normal((2, 10, 4))
    assert mixing_of(chain).times == pytest.approx([(1.0 + memory) / (1.0 - memory)] * 4, rel=0.15)


def test_outcomes_no_block_has_are_not_explained() -> None:
    trials = cosines(80)
    points = np.tile(TRUTH, (50, 1))
    rng = np.random.default_rng(1)
    right = agreement_of(Likelihood(trials, 9.81, LOWEST, HIGHEST), points, rng)
    assert right.fault is None
    assert right.strange == []
    wrong = [replace(t, overturned=not t.overturned) if k % 4 == 0 else t for k, t in enumerate(trials)]
    shuffled = agreement_of(Likelihood(wrong, 9.81, LOWEST, HIGHEST), points, rng)
    assert "does not explain" in str(shuffled.fault)
    assert 15 <= len(shuffled.strange) <= 20
    assert shuffled.brier == pytest.approx(0.25, abs=0.02)


def test_trials_far_from_any_boundary_bound_nothing() -> None:
    trials = [Trial("cosine", 9.0, 1.0, True)] * 6 + [Trial("cosine", 0.05, 5.0, False)] * 6
    fit = fit_outcomes(trials, effort=CHEAP)
    assert not fit.trustworthy
    assert "eta" in fit.unbounded
    assert any("the trials do not bound" in line for line in outcome_lines(fit))
