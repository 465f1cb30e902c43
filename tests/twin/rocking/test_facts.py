"""The default solver against the table of facts: block, free rocking, one full sine wave."""

from __future__ import annotations

import math

import pytest

from tests.facts import B6L, BOUNDARIES, FREE_IMPACTS, FREE_PEAKS, FREE_REST, FREE_ROTATION_AT_2, sine
from twin import Outcome, simulate


def test_block_b6l() -> None:
    assert B6L.slenderness == pytest.approx(0.218668945873942, rel=1e-14)
    assert B6L.half_diagonal == pytest.approx(0.138293166859393, rel=1e-14)
    # 40-digit arithmetic; the table of facts prints 7.293983464774344, which its own times contradict.
    assert B6L.frequency_parameter == pytest.approx(7.293983464474362666, rel=1e-15)
    assert B6L.housner_restitution == pytest.approx(0.929411764705882, rel=1e-14)
    assert B6L.uplift_acceleration == pytest.approx(2.18, rel=1e-15)


def test_free_rocking() -> None:
    response = simulate(B6L, initial_rotation=0.15)
    assert response.outcome is Outcome.ROCKED
    for n, (time, rate) in FREE_IMPACTS.items():
        assert response.impact_times[n - 1] == pytest.approx(time, abs=1e-13)
        # From +0.15 rad the first impact comes with a negative rate, and the corners take turns.
        assert response.impact_rates[n - 1] == pytest.approx(-rate * (-1) ** (n - 1), abs=1e-13)
    assert response.rest_time == pytest.approx(FREE_REST, abs=1e-13)
    assert response.rotation(2.0) == pytest.approx(FREE_ROTATION_AT_2, abs=1e-14)
    assert response.uplift_time == 0.0
    assert response.peak_rotation == 0.15
    assert response.rotation_error < 1e-12


def test_peaks_between_impacts() -> None:
    response = simulate(B6L, initial_rotation=0.15)
    for n, peak in FREE_PEAKS.items():
        before, after = response.impact_times[n - 1 : n + 1]
        # On a still base the flight is symmetric: the peak lies in its middle.
        assert abs(response.rotation(0.5 * (before + after))) == pytest.approx(peak, abs=1e-14)


def test_the_quarter_period_is_not_the_thesis_one() -> None:
    first = simulate(B6L, initial_rotation=0.15).impact_times[0]
    assert first == pytest.approx(0.250518129832, abs=1e-12)
    assert abs(first - 0.2510) > 4e-4


def test_impacts_are_listed_down_to_the_named_rate() -> None:
    response = simulate(B6L, initial_rotation=0.15)
    floor = 1e-6 * B6L.frequency_parameter
    assert abs(response.impact_rates[-1]) >= floor
    assert abs(response.impact_rates[-1]) * response.restitution < floor


@pytest.mark.parametrize(("frequency", "amplitude", "above"), BOUNDARIES)
@pytest.mark.parametrize("distance", [1e-6, 1e-9])
def test_both_sides_of_every_boundary(frequency: float, amplitude: float, above: bool, distance: float) -> None:
    fallen, standing = Outcome.OVERTURNED, Outcome.ROCKED
    just_above = simulate(B6L, sine(amplitude * (1.0 + distance), frequency))
    just_below = simulate(B6L, sine(amplitude * (1.0 - distance), frequency))
    assert just_above.outcome is (fallen if above else standing)
    assert just_below.outcome is (standing if above else fallen)


def test_number_of_impacts_tells_the_modes_apart() -> None:
    with_impact = simulate(B6L, sine(1.25, 2))
    without = simulate(B6L, sine(2.36, 2))
    assert with_impact.outcome is without.outcome is Outcome.OVERTURNED
    assert len(with_impact.impact_times) > 0
    assert len(without.impact_times) == 0
    assert math.isclose(with_impact.peak_rotation, math.pi / 2)


def test_compiled_code_is_tied_to_every_module_of_the_solver() -> None:
    """Numba alone would keep calling an old version of what an unchanged file imports."""
    from twin.rocking.batch.compiled import lent
    from twin.rocking.compiled import SOURCE_DIGEST, compiled
    from twin.rocking.verdict import barrier_margins

    for function in (barrier_margins, compiled(_one), lent(_one)):
        cache = function._cache._cache_file  # pyright: ignore[reportAttributeAccessIssue, reportFunctionMemberAccess]
        assert cache._source_stamp[1] == SOURCE_DIGEST


def _one(x: float) -> float:
    return x
