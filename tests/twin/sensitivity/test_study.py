"""The three models beside each other: against the facts' numbers, the map, and `simulate` one by one."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from excitation import ConstantPulse, DoublePulse, Pulse, Record
from tests.facts import B6L, FREE_IMPACTS, FREE_REST, LIMIT, P, quarter_period, sine
from twin import overturning_map
from twin.errors import InputError
from twin.rocking.methods.problem import LINEARISED, NONLINEAR, QUASI_LINEAR
from twin.scene import load_scene
from twin.sensitivity.case import Case, case_of
from twin.sensitivity.cloud import SIZES, Share, class_of, cloud_of, default_rate_spread
from twin.sensitivity.free import TILTS, free_times, over_slenderness, over_tilt, release_ratio
from twin.sensitivity.outcomes import difference, has_closed_form, over_amplitude
from twin.sensitivity.outcomes import over_slenderness as outcomes_over_slenderness
from twin.sensitivity.pulses import LEFT, REFUSED, RIGHT, ROCKS, STAYS, UNDECIDED, row_of, scaled
from twin.sensitivity.study import Settings, study_scene

ALPHA = B6L.slenderness
CASE = Case(B6L, None, sine(1.35, 2.0))
QUICK = Settings(cells=9, sparse=0, draws=40)


def test_the_quarter_periods_are_the_facts() -> None:
    times = free_times(replace(CASE, tilt=0.15))
    assert times[NONLINEAR] == pytest.approx((FREE_IMPACTS[1][0], FREE_REST), abs=1e-11)
    assert times[LINEARISED] == pytest.approx((0.250314513548138, 4.18419120279822), abs=1e-11)
    assert times[QUASI_LINEAR][0] == pytest.approx(0.248321744239537, abs=1e-11)


def test_over_tilt_and_slenderness_each_point_is_a_block_let_go() -> None:
    tilt = over_tilt(CASE)
    for place in (0, 20, 48):
        assert tilt.quarters[NONLINEAR][place] == pytest.approx(quarter_period(TILTS[place] * ALPHA), rel=1e-11)
    # Linearised: p T = acosh(1 / (1 - theta0 / alpha)), whatever the slenderness (Housner 1963).
    assert P * tilt.quarters[LINEARISED] == pytest.approx(np.arccosh(1.0 / (1.0 - TILTS)), rel=1e-11)
    bulk = over_slenderness(CASE)
    assert release_ratio(CASE) == 0.5
    assert bulk.quarters[LINEARISED] == pytest.approx(np.full(len(bulk.at), math.acosh(2.0) / P), rel=1e-11)
    assert np.all(np.diff(bulk.quarter_errors(LINEARISED)) < 0.0)
    # A slender block is linear.
    assert abs(bulk.quarter_errors(QUASI_LINEAR)[0]) < 1e-3
    assert bulk.reaches(LINEARISED, 1e-9) is None
    assert bulk.reaches(LINEARISED, 1.0) == bulk.at[-1]


def test_a_model_that_refuses_is_left_out() -> None:
    # The quasi-linear equilibrium tan(alpha) lies beyond pi/2.
    assert math.isnan(free_times(replace(CASE, tilt=0.15).of_slenderness(1.1))[QUASI_LINEAR][0])
    case = replace(CASE, pulse=ConstantPulse(LIMIT, 0.1)).of_slenderness(1.1)
    assert row_of(case, scaled(case, np.array([1.0, 2.0])), 0.1, QUASI_LINEAR)[0].tolist() == [REFUSED, REFUSED]


def test_a_block_of_other_slenderness_has_the_same_diagonal_and_tilts_as_far() -> None:
    other = replace(CASE, tilt=0.1).of_slenderness(0.4)
    assert other.block.half_diagonal == pytest.approx(B6L.half_diagonal, rel=1e-14)
    assert other.block.slenderness == pytest.approx(0.4, rel=1e-14)
    assert other.relative_tilt == pytest.approx(0.1 / ALPHA, rel=1e-14)
    assert other.eta == other.block.housner_restitution
    assert replace(CASE, restitution=0.9).of_slenderness(0.4).eta == 0.9


def test_over_amplitude_is_the_map() -> None:
    factors, tilts = np.linspace(0.5, 3.0, 13), np.array([-0.3, 0.0, 0.4])
    panel = over_amplitude(CASE, tilts, factors)
    for column, tilt in enumerate(tilts):
        chart = overturning_map(B6L, amplitudes=1.35 * factors, frequencies=[2.0], initial_rotation=tilt * ALPHA)
        assert np.array_equal(panel.classes[:, column] == LEFT, chart.direction[:, 0] < 0)
        assert np.array_equal(panel.classes[:, column] == RIGHT, chart.direction[:, 0] > 0)
        assert np.array_equal(panel.impacts[:, column], chart.impacts[:, 0])


@pytest.mark.parametrize("model", [NONLINEAR, LINEARISED])
@pytest.mark.parametrize(
    "pulse",
    [
        sine(1.35, 2.0, 3.0),
        DoublePulse(0.3, 0.012),
        Record(np.array([0.0, 3.0, -4.0, 4.0, -3.5, 0.5, 0.0]), 0.12),
    ],
    ids=["three cycles", "double pulse", "record"],
)
def test_each_cell_is_what_simulate_says(pulse: Pulse, model: str) -> None:
    case = replace(CASE, pulse=pulse)
    factors = np.array([0.4, 0.9, 1.0, 1.7])
    for tilt in (-0.05, 0.0, 0.08):
        classes, _ = row_of(case, scaled(case, factors), tilt, model)
        expected: list[int] = []
        for factor in factors:
            one = replace(case, pulse=pulse.scaled(float(factor)))
            expected.append(class_of(one.response(model, tilt)))
        assert classes.tolist() == expected


def test_a_pulse_that_cannot_be_scaled_so_is_no_pulse() -> None:
    # Ten times the velocity is not reached within the gap.
    case = replace(CASE, pulse=DoublePulse(0.3, 0.004))
    classes, _ = row_of(case, scaled(case, np.array([1.0, 100.0])), 0.0)
    assert classes[1] == REFUSED
    assert classes[0] != REFUSED


def test_over_slenderness_each_cell_is_its_own_block() -> None:
    tilts, alphas = np.array([-0.2, 0.3]), np.array([0.12, ALPHA, 0.4])
    panel = outcomes_over_slenderness(CASE, tilts, alphas)
    for row, alpha in enumerate(alphas):
        for column, tilt in enumerate(tilts):
            case = CASE.of_slenderness(float(alpha))
            assert panel.classes[row, column] == class_of(case.response(NONLINEAR, tilt * alpha))


def test_mirrored_pulses_fall_to_the_other_side() -> None:
    factors, tilts = np.array([-2.5, -1.5, 1.5, 2.5]), np.linspace(-0.5, 0.5, 5)
    classes = over_amplitude(CASE, tilts, factors).classes
    swapped = np.array([STAYS, ROCKS, RIGHT, LEFT, UNDECIDED, REFUSED])[classes]
    assert np.array_equal(classes, swapped[::-1, ::-1])


def test_a_difference_is_counted_where_both_decide() -> None:
    panel = over_amplitude(CASE, np.array([0.0, 0.1]), np.array([1.0, 2.0]))
    truth = replace(panel, classes=np.array([[LEFT, ROCKS], [UNDECIDED, RIGHT]], dtype=np.uint8))
    simpler = replace(panel, classes=np.array([[RIGHT, STAYS], [LEFT, REFUSED]], dtype=np.uint8))
    found = difference(LINEARISED, truth, simpler)
    assert (found.compared, found.outcome, found.direction, found.refused) == (2, 0, 1, 1)
    found = difference(LINEARISED, truth, replace(panel, classes=np.full((2, 2), LEFT, dtype=np.uint8)))
    assert (found.compared, found.outcome, found.direction) == (3, 1, 1)


def test_perturbed_starts() -> None:
    cloud = cloud_of(CASE, 0.002, default_rate_spread(CASE, 0.002), 60, seed=4)
    assert cloud.rate_spread == pytest.approx(0.002 * P)
    assert sum(cloud.share(k).count for k in range(6)) == 60
    for k in (0, 17, 59):
        response = CASE.response(NONLINEAR, float(cloud.tilts[k]), float(cloud.rates[k]))
        assert cloud.classes[k] == class_of(response)
    assert [size for size, _ in cloud.sizes] == list(SIZES)
    assert cloud.sizes[SIZES.index(1.0)][1] == cloud.changed
    again = cloud_of(CASE, 0.002, cloud.rate_spread, 60, seed=4)
    assert np.array_equal(again.classes, cloud.classes)
    none = cloud_of(CASE, 0.0, 0.0, 10, seed=1)
    assert none.changed.count == 0


def test_the_interval_of_a_share_is_clopper_and_pearsons() -> None:
    assert Share(0, 100).interval == pytest.approx((0.0, 1.0 - 0.025**0.01), abs=1e-12)
    assert Share(100, 100).interval == pytest.approx((0.025**0.01, 1.0), abs=1e-12)
    assert Share(10, 100).interval == pytest.approx((0.04900469, 0.17622260), abs=1e-7)


def test_a_study_passes_through_its_scene() -> None:
    scene = load_scene("b6l_sine")
    study = study_scene(scene, QUICK)
    forced = study.forced
    assert forced is not None
    assert 1.0 in forced.nonlinear.others
    assert ALPHA in forced.slender.others
    assert forced.sparse is None
    row = forced.nonlinear.classes[list(forced.nonlinear.others).index(1.0)]
    assert row[4] == study.cloud.nominal == class_of(case_of(scene).response(NONLINEAR))
    below, above = forced.nearest_tilts(0.0)
    assert below is not None
    assert below < 0.0
    assert above is None or above > 0.0
    assert study_scene(load_scene("b6l_free"), QUICK).forced is None
    assert not has_closed_form(study.case)


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        (Settings(cells=3), "--cells is 3"),
        (Settings(cells=9, sparse=-1), "--quasi-linear is -1"),
        (Settings(draws=3), "--draws is 3"),
        (Settings(seed=-1), "--seed is -1"),
        (Settings(tilt_spread=math.nan), "--tilt-spread is nan"),
        (Settings(rate_spread=-1.0), "--rate-spread is -1"),
    ],
)
def test_settings_out_of_range_are_refused(settings: Settings, words: str) -> None:
    with pytest.raises(InputError, match=words):
        study_scene(load_scene("b6l_sine"), settings)
