"""Maps against the facts, against `simulate`, and against codes that share nothing with the kernel."""

from __future__ import annotations

import math
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from excitation import SineWave
from tests.facts import B6L, BOUNDARIES, LIMIT, P
from twin import Block, Outcome, OverturningMap, overturning_map, simulate
from twin.map.blocks import Question, block_ranges, solve
from twin.map.grid import KINDS, make_grid
from twin.rocking.verdict import barrier_margins

AXIS = np.linspace(0.1, 10.0, 100)


@pytest.fixture(scope="module")
def single_sine() -> OverturningMap:
    return overturning_map(B6L, amplitudes=AXIS, frequencies=AXIS, times=True, peaks=True)


def test_the_map_of_the_thesis(single_sine: OverturningMap) -> None:
    verdicts = overturning_map(B6L, amplitudes=AXIS, frequencies=AXIS)
    assert int(verdicts.overturned.sum()) == 5494
    assert not np.any(verdicts.codes == 3)
    # Three routes to the same: the quick look, the quick look with every digit, the accurate method on all cells.
    timed = overturning_map(B6L, amplitudes=AXIS, frequencies=AXIS, times=True)
    for other in (timed, single_sine):
        assert np.array_equal(verdicts.codes, other.codes)
        assert np.array_equal(verdicts.impacts, other.impacts)
        assert np.array_equal(verdicts.direction, other.direction)
    assert timed.overturning_time is not None
    assert single_sine.overturning_time is not None
    assert np.array_equal(np.isnan(timed.overturning_time), ~verdicts.overturned)
    late = np.abs(timed.overturning_time - single_sine.overturning_time)[verdicts.overturned]
    assert late.max() < 1e-9
    assert np.median(late) < 1e-13


def rk4_overturns(amplitude: np.ndarray, frequency: np.ndarray, alpha: float, eta: float) -> np.ndarray:
    """Return the verdicts of sines on a block, all cells at once: RK4 with 4000 steps and halved steps at a contact.

    Its step at a contact ends within 2^-40 of the step of it, which is all this has in common with the kernel.
    """
    k = np.tan(alpha) * amplitude
    end = 2.0 * np.pi / frequency
    moving = amplitude > 1.0
    t = np.where(moving, np.arcsin(np.minimum(1.0, 1.0 / amplitude)) / frequency, end)
    side, phi, v = -np.ones_like(t), np.zeros_like(t), np.zeros_like(t)
    whole = (end - t) / 1500.0
    fallen = np.zeros(t.shape, dtype=bool)

    def slope(t: np.ndarray, phi: np.ndarray) -> np.ndarray:
        return -np.sin(alpha - phi) - side * k * np.sin(frequency * t) * np.cos(alpha - phi)

    def step(h: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        a1 = slope(t, phi)
        a2 = slope(t + 0.5 * h, phi + 0.5 * h * v)
        a3 = slope(t + 0.5 * h, phi + 0.5 * h * v + 0.25 * h * h * a1)
        a4 = slope(t + h, phi + h * v + 0.5 * h * h * a2)
        return phi + h * v + h * h * (a1 + a2 + a3) / 6.0, v + h * (a1 + 2.0 * a2 + 2.0 * a3 + a4) / 6.0

    for _ in range(1700):
        h = np.minimum(whole, end - t)
        if not h.any():
            break
        low, high = np.zeros_like(h), h.copy()
        new, rate = step(h)
        struck = (new < 0.0) & (h > 0.0)
        if struck.any():
            for _ in range(40):
                middle = 0.5 * (low + high)
                below = step(middle)[0] < 0.0
                high = np.where(below, middle, high)
                low = np.where(below, low, middle)
            h = np.where(struck, high, h)
            new, rate = step(h)
        t = t + h
        phi = np.where(struck, 0.0, new)
        v = np.where(struck, -eta * rate, rate)
        side = np.where(struck, -side, side)
        flat = phi >= 0.5 * np.pi
        fallen |= flat
        t = np.where(flat, end, t)
    for cell in np.nonzero(moving & ~fallen)[0]:
        ahead, around = barrier_margins(alpha, eta, alpha - float(phi[cell]), float(v[cell]))
        fallen[cell] = ahead > 0.0 or around > 0.0
    return fallen


def test_against_a_code_of_its_own(single_sine: OverturningMap) -> None:
    """Every sixth cell each way; blocks that come to rest and lift again are left to the comparison below."""
    rows = np.arange(11, 100, 6)
    a, w = (axis.ravel() for axis in np.meshgrid(AXIS[rows], AXIS[::6], indexing="ij"))
    expected = rk4_overturns(a, w, B6L.slenderness, B6L.housner_restitution)
    assert np.array_equal(single_sine.overturned[np.ix_(rows, np.arange(0, 100, 6))].ravel(), expected)


def test_against_simulate(single_sine: OverturningMap) -> None:
    rng = np.random.default_rng(7)
    for row, column in rng.integers(0, 100, (60, 2)):
        f = AXIS[column] * P / (2.0 * math.pi)
        response = simulate(B6L, SineWave(AXIS[row] * LIMIT, f))
        assert single_sine.outcome[row, column] is response.outcome
        assert single_sine.direction[row, column] == response.direction
        assert single_sine.peak_rotation is not None
        assert single_sine.peak_rotation[row, column] == pytest.approx(response.peak_rotation, abs=1e-12)
        if response.outcome is Outcome.OVERTURNED:
            assert single_sine.impacts[row, column] == len(response.impact_times)
            assert single_sine.overturning_time is not None
            assert single_sine.overturning_time[row, column] == pytest.approx(response.overturning_time, abs=1e-11)


@pytest.mark.parametrize("distance", [1e-6, 1e-9])
def test_both_sides_of_every_boundary(distance: float) -> None:
    for frequency, amplitude, above in BOUNDARIES:
        rows = [amplitude * (1.0 - distance), amplitude * (1.0 + distance)]
        chart = overturning_map(B6L, amplitudes=rows, frequencies=[frequency])
        assert chart.overturned.ravel().tolist() == [not above, above]
        assert not np.any(chart.codes == 3)


CASES = {
    "sine": {"amplitudes": np.linspace(0.9, 3.0, 5), "frequencies": np.linspace(0.3, 6.0, 5)},
    "cosine": {"amplitudes": np.linspace(0.9, 6.0, 5), "frequencies": np.linspace(0.3, 9.0, 5)},
    "lasting sine": {"amplitudes": np.linspace(0.9, 2.0, 4), "frequencies": np.linspace(0.5, 9.0, 4), "duration": 2.0},
    "constant": {"amplitudes": np.linspace(0.9, 6.0, 5), "durations": np.linspace(0.01, 0.3, 5)},
    "double pulse": {"peak_velocities": np.linspace(0.1, 0.9, 5), "stop_gaps": np.linspace(0.004, 0.1, 5)},
}


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(("tilt", "eta"), [(0.0, None), (0.05, None), (-0.2, 0.5), (0.0, 0.0)])
def test_every_kind_against_simulate(kind: str, tilt: float, eta: float | None) -> None:
    case = CASES[kind]
    chart = overturning_map(B6L, kind, initial_rotation=tilt, restitution=eta, **case)
    by_cell = overturning_map(B6L, kind, initial_rotation=tilt, restitution=eta, method="taylor", **case)
    assert np.array_equal(chart.codes, by_cell.codes)
    assert np.array_equal(chart.impacts, by_cell.impacts)
    assert np.array_equal(chart.direction, by_cell.direction)
    assert tilt != 0.0 or len(set(chart.codes.ravel().tolist())) > 1


def test_other_models_go_through_simulate() -> None:
    chart = overturning_map(B6L, amplitudes=[1.5, 4.0], frequencies=[2.0, 5.0], model="linearised")
    assert chart.overturned.shape == (2, 2)
    with pytest.raises(ValueError, match="no method 'euler'"):
        overturning_map(B6L, amplitudes=[1.5], frequencies=[2.0], method="euler")


def test_the_sense_of_the_wave_only_mirrors() -> None:
    rows, columns = np.linspace(1.05, 8.0, 60), np.linspace(0.2, 9.0, 60)
    one = overturning_map(B6L, "cosine", amplitudes=rows, frequencies=columns, times=True)
    other = overturning_map(B6L, "cosine", amplitudes=-rows, frequencies=columns, times=True)
    assert np.array_equal(one.codes, other.codes)
    assert np.array_equal(one.direction, -other.direction)
    assert one.overturning_time is not None
    assert np.array_equal(one.overturning_time, other.overturning_time, equal_nan=True)


def test_the_threshold_itself_never_lifts() -> None:
    chart = overturning_map(B6L, amplitudes=[-1.0, 1.0, 1.0001], frequencies=[0.5, 3.0])
    assert chart.outcome[:2].ravel().tolist() == [Outcome.STAYED] * 4
    assert chart.outcome[2].tolist() == [Outcome.ROCKED] * 2


def test_impacts_before_a_rest_are_counted_as_simulate_lists_them() -> None:
    chart = overturning_map(B6L, "cosine", amplitudes=[1.0172903124529762], frequencies=[0.19180351904762877])
    response = simulate(B6L, chart.grid.pulse(0))
    assert chart.impacts[0, 0] == len(response.impact_times) > 100


def test_neither_partition_nor_executor_changes_anything() -> None:
    grid = make_grid(B6L, "lasting sine", amplitudes=np.linspace(1.0, 3.0, 23), frequencies=AXIS[::5], duration=1.0)
    question = Question(grid, times=True)
    whole = solve(question, 0, grid.size)
    for size in (1, 7, 100):
        parts = [solve(question, *cells) for cells in block_ranges(question, size)]
        for name in ("codes", "impacts", "directions", "times"):
            joined = np.concatenate([getattr(part, name) for part in parts])
            assert np.array_equal(joined, getattr(whole, name), equal_nan=name == "times")
    with ThreadPoolExecutor(3) as pool:
        chart = overturning_map(
            B6L, "lasting sine", amplitudes=grid.rows, frequencies=grid.columns, duration=1.0, times=True, executor=pool
        )
    assert np.array_equal(chart.codes.ravel(), whole.codes)
    assert np.array_equal(chart.overturning_time.ravel(), whole.times, equal_nan=True)


def test_a_lasting_sine_is_seldom_undecided() -> None:
    """Every second row and column of the 100 x 100 map; the decided cells near the limit of doubt are looked at again.

    A cell whose neighbour by one rounding is different must not have been decided: 60 cells are run with amplitude
    changed by 1e-15, and agree.
    """
    half = AXIS[1::2]
    chart = overturning_map(B6L, "lasting sine", amplitudes=half, frequencies=half, duration=10.0)
    assert np.mean(chart.codes == 3) <= 0.005
    louder = overturning_map(B6L, "lasting sine", amplitudes=half * (1.0 + 2e-16), frequencies=half, duration=10.0)
    decided = (chart.codes != 3) & (louder.codes != 3)
    assert np.array_equal(chart.codes[decided], louder.codes[decided])


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"kind": "square", "amplitudes": [1.0], "frequencies": [1.0]}, "kind is 'square'"),
        ({"amplitudes": [1.0]}, "needs frequencies"),
        ({"amplitudes": [1.0], "frequencies": [1.0], "durations": [1.0]}, "has no durations"),
        ({"amplitudes": [], "frequencies": [1.0]}, "at least one number"),
        ({"amplitudes": [math.nan], "frequencies": [1.0]}, "must be finite"),
        ({"amplitudes": [1.0], "frequencies": [0.0]}, "above 0"),
        ({"amplitudes": [1.0], "frequencies": [1.0], "duration": 2.0}, "has no duration"),
        ({"kind": "lasting sine", "amplitudes": [1.0], "frequencies": [1.0]}, "needs duration"),
        ({"amplitudes": [1.0], "frequencies": [1.0], "restitution": 1.5}, "restitution is 1.5"),
        ({"amplitudes": [1.0], "frequencies": [1.0], "initial_rotation": 2.0}, "initial rotation is 2 rad"),
        ({"amplitudes": [1.0], "frequencies": [1.0], "tolerance": 0.0}, "tolerance is 0 rad"),
    ],
)
def test_what_cannot_be_asked(arguments: dict[str, object], words: str) -> None:
    with pytest.raises(ValueError, match=words):
        overturning_map(B6L, **arguments)


def test_a_double_pulse_without_room_is_none() -> None:
    chart = overturning_map(B6L, "double pulse", peak_velocities=[0.5], stop_gaps=[0.001, 0.05], times=True)
    assert chart.outcome[0, 0] is None
    assert not chart.overturned[0, 0]
    assert chart.outcome[0, 1] is not None


@pytest.mark.parametrize("size", [(0.2, 0.2), (0.02, 0.5), (0.3, 0.2)])
def test_other_blocks(size: tuple[float, float]) -> None:
    block = Block(*size)
    rows, columns = np.linspace(0.9, 8.0, 6), np.linspace(0.4, 9.0, 5)
    chart = overturning_map(block, amplitudes=rows, frequencies=columns)
    by_cell = overturning_map(block, amplitudes=rows, frequencies=columns, method="taylor")
    assert np.array_equal(chart.codes, by_cell.codes)
    assert np.array_equal(chart.impacts, by_cell.impacts)
