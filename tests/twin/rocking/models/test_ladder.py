"""The ladder of models: what each rung is taken for, and that its bound holds against the nonlinear answer."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from excitation import ConstantPulse, CosineWave, DoublePulse, Motion, Pulse, Record, SineWave
from tests.facts import B6L, P, constant, scipy_reference, sine
from twin import Block, Outcome, simulate
from twin.rocking.methods import MethodRefused, Problem, Solution, method
from twin.rocking.models.flight_error import Unbounded
from twin.rocking.models.free_tail import free_tail
from twin.rocking.models.ladder import choose
from twin.rocking.models.model_error import model_error
from twin.rocking.response import Response

SCENES = 1000
TOLERANCE = 0.01
NOTHING = np.zeros((0, 7))


def scene(rng: np.random.Generator) -> tuple[Block, float, Pulse | None, float]:
    """Return block (slender to bulky), restitution, pulse (near and far from uplift, all kinds), tilt."""
    alpha, radius = 10.0 ** rng.uniform(-1.5, -0.1), 10.0 ** rng.uniform(-1.2, 0.3)
    block = Block(2.0 * radius * math.sin(alpha), 2.0 * radius * math.cos(alpha))
    eta = block.housner_restitution if rng.random() < 0.6 else rng.uniform(0.3, 0.98)
    amplitude = 1.0 + 10.0 ** rng.uniform(-2.0, 1.0) if rng.random() < 0.9 else rng.uniform(0.3, 1.02)
    a = float(amplitude * block.uplift_acceleration * rng.choice([-1.0, 1.0]))
    p = block.frequency_parameter
    f = 10.0 ** rng.uniform(-0.5, 1.3) * p / (2.0 * math.pi)
    kind = rng.integers(6)
    pulse: Pulse | None = None
    tilt = rng.uniform(-0.5, 0.5) * alpha if rng.random() < 0.2 else 0.0
    if kind == 0:
        pulse = SineWave(a, f)
    elif kind == 1:
        pulse = CosineWave(a, f)
    elif kind == 2:
        pulse = ConstantPulse(a, 10.0 ** rng.uniform(-2.0, 0.0) / p)
    elif kind == 3:
        pulse = SineWave(a, f, float(rng.choice([0.5, 1.5, 3.0])))
    elif kind == 4:
        pulse = Record(np.append(0.0, rng.standard_normal(30)) * 0.5 * a, 0.2 / p)
    else:
        tilt = rng.uniform(-0.98, 0.98) * alpha
    return block, eta, pulse, tilt


def problem(block: Block, eta: float, pulse: Pulse | None, tilt: float, model: str) -> Problem:
    pieces = NOTHING if pulse is None else pulse.pieces
    return Problem(block, eta, pieces, tilt, 0.0, math.inf, 1e-10, None, model)


def errors(simple: Response | Solution, full: Response) -> tuple[float, float]:
    """Return relative errors of the peak, and of the times of every impact both list and of rest, from uplift on."""
    peak = simple.peak_rotation if isinstance(simple, Response) else simple.peak
    start = full.uplift_time or 0.0
    n = min(len(full.impact_times), len(simple.impact_times))
    off = np.abs(np.asarray(full.impact_times[:n]) - simple.impact_times[:n]) / (full.impact_times[:n] - start)
    times = float(off.max()) if n else 0.0
    if full.rest_time is not None and simple.rest_time is not None:
        times = max(times, abs(full.rest_time - simple.rest_time) / (full.rest_time - start))
    return abs(peak - full.peak_rotation) / full.peak_rotation, times


def test_a_thousand_scenes(record_property: Callable[[str, object], None]) -> None:
    """Wherever a simpler rung is taken, the nonlinear answer agrees: same outcome, peak and times within 1 %.

    Compared are all impacts, index by index, down to the last both list (a rate of 1e-6 p), and the time of rest.
    Seen: 69 at rest, 206 linearised, 118 quasi-linear, 607 nonlinear; a run's own counts are in its JUnit report.
    """
    rng = np.random.default_rng(20180)
    taken: Counter[str] = Counter()
    for _ in range(SCENES):
        block, eta, pulse, tilt = scene(rng)
        auto = simulate(block, pulse, restitution=eta, initial_rotation=tilt, model="auto")
        taken[auto.model] += 1
        assert auto.model_reason.startswith(auto.model)
        if auto.model == "nonlinear":
            continue
        full = simulate(block, pulse, restitution=eta, initial_rotation=tilt)
        assert auto.outcome is full.outcome
        assert (auto.outcome is Outcome.STAYED) == (auto.model == "at rest")
        if auto.model == "at rest":
            continue
        assert abs(len(auto.impact_times) - len(full.impact_times)) <= 1 + 0.02 * len(full.impact_times)
        assert max(errors(auto, full)) <= TOLERANCE
    record_property("rungs", dict(taken))
    assert taken["linearised"] > 0.15 * SCENES
    assert taken["quasi-linear"] > 0.03 * SCENES
    assert taken["at rest"] > 0.03 * SCENES
    assert taken["nonlinear"] < 0.8 * SCENES


def test_the_bound_is_above_the_error_at_any_size() -> None:
    """Not only inside 1 %: every bound the ladder can compute covers the error, and proves the outcome."""
    rng = np.random.default_rng(7)
    closed = method("closed-form")
    sharpness: list[float] = []
    for _ in range(250):
        block, eta, pulse, tilt = scene(rng)
        full = None
        for model in ("linearised", "quasi-linear"):
            asked = problem(block, eta, pulse, tilt, model)
            try:
                solution = closed.solve(asked)
                bound = model_error(asked, solution)
            except (MethodRefused, Unbounded):
                continue
            full = full or simulate(block, pulse, restitution=eta, initial_rotation=tilt)
            assert full.outcome is Outcome.ROCKED
            peak, times = errors(solution, full)
            assert peak <= bound.peak + 1e-9
            assert times <= bound.times + 1e-9
            sharpness.append((bound.largest + 1e-6) / (max(peak, times) + 1e-6))
    assert len(sharpness) > 100
    assert np.median(sharpness) < 2.0


def test_jumps_pushes_and_whole_runs_of_a_table() -> None:
    """Double pulses, a first push, and motions that approach, wait and return: what the bound proves is so."""
    rng = np.random.default_rng(11)
    closed = method("closed-form")
    proved: Counter[str] = Counter()
    for number in range(240):
        alpha, radius = 10.0 ** rng.uniform(-2.0, 0.0), 10.0 ** rng.uniform(-1.2, 1.0)
        block = Block(2.0 * radius * math.sin(alpha), 2.0 * radius * math.cos(alpha))
        p, up = block.frequency_parameter, block.uplift_acceleration
        eta, rate = rng.uniform(0.2, 0.999), 0.0
        amplitude = up * (1.0 + 10.0 ** rng.uniform(-3.0, 1.3))
        kind = ("double pulse", "push", "motion")[number % 3]
        pulse: Pulse | None = None
        if kind == "double pulse":
            speed = rng.uniform(0.1, 1.0) * alpha * 9.81 / p
            gap = speed**2 / (3.0 * amplitude) + rng.uniform(0.1, 1.0) * alpha * 9.81 / p**2
            pulse = DoublePulse(speed, gap, 0.0, 3.0 * amplitude)
        elif kind == "push":
            rate = rng.uniform(-1.02, 1.02) * 2.0 * math.sin(0.5 * alpha) * p
        else:
            wave = SineWave(amplitude, 10.0 ** rng.uniform(0.3, 1.3) * p / (2.0 * math.pi))
            pulse = Motion(wave, 0.5 * up, settle=1.0 / p, wait=rng.uniform(5.0, 80.0) / p)
        full = simulate(block, pulse, restitution=eta, initial_angular_velocity=rate)
        for model in ("linearised", "quasi-linear"):
            asked = replace(problem(block, eta, pulse, 0.0, model), rate=rate)
            try:
                solution = closed.solve(asked)
                bound = model_error(asked, solution)
            except (MethodRefused, Unbounded):
                continue
            proved[kind] += 1
            assert full.outcome is Outcome.ROCKED
            peak, times = errors(solution, full)
            assert peak <= bound.peak + 1e-9
            assert times <= bound.times + 1e-9
    assert min(proved["double pulse"], proved["push"], proved["motion"]) >= 5


@pytest.mark.parametrize(
    ("block", "pulse", "tilt", "model"),
    [
        (B6L, sine(0.999, 3.0), 0.0, "at rest"),
        (B6L, None, 0.0, "at rest"),
        (B6L, None, 0.15, "linearised"),
        (Block(0.02, 0.3), SineWave(2.0 * 9.81 / 15.0, 6.0), 0.0, "linearised"),
        (B6L, constant(2.0, 0.2 / P), 0.0, "quasi-linear"),
        (B6L, sine(1.25, 2.0), 0.0, "nonlinear"),
        (B6L, sine(3.0, 3.0), 0.0, "nonlinear"),
        (Block(0.5, 0.6), None, 0.3, "nonlinear"),
    ],
)
def test_what_each_rung_is_for(block: Block, pulse: Pulse | None, tilt: float, model: str) -> None:
    response = simulate(block, pulse, initial_rotation=tilt, model="auto")
    assert response.model == model
    assert response.model_reason.startswith(f"{model}: ")
    if model == "nonlinear":
        assert "the linearised one" in response.model_reason
        assert response.method == "taylor"


def test_at_rest_is_exact_at_the_threshold() -> None:
    """A = 1 exactly never moves; a rounding more does not either, and 1e-12 more does."""
    assert simulate(B6L, sine(1.0, 3.0), model="auto").model == "at rest"
    above = simulate(B6L, sine(1.0 + 1e-12, 3.0), model="auto")
    assert above.model == "nonlinear"
    # What never lifts the block within the run is not looked at beyond it.
    cut = simulate(B6L, sine(3.0, 3.0), duration=0.015, model="auto")
    assert (cut.model, cut.outcome) == ("at rest", Outcome.STAYED)
    assert simulate(B6L, sine(3.0, 3.0), duration=0.016).uplift_time is not None
    assert cut.rotation(0.01) == 0.0


def test_a_tighter_tolerance_climbs() -> None:
    models = [simulate(B6L, initial_rotation=0.15, model="auto", model_tolerance=t).model for t in (0.01, 1e-3)]
    assert models == ["linearised", "nonlinear"]


def test_near_the_point_of_no_return_no_simpler_rung_is_taken() -> None:
    """Shaken to within 2 % of overturning; tilted to alpha or beyond; pushed off at the rate that overturns it."""
    alpha = B6L.slenderness
    for tilt in (1.0, 1.0 + 1e-9, 1.01):
        assert simulate(B6L, initial_rotation=alpha * tilt, model="auto").model == "nonlinear"
    for share in (0.998, 1.0, 1.002):
        rate = share * 2.0 * math.sin(0.5 * alpha) * P
        assert simulate(B6L, initial_angular_velocity=rate, model="auto").model == "nonlinear"
    for amplitude in np.linspace(1.2, 1.2213, 20).tolist():  # overturns from 1.22129888
        assert simulate(B6L, sine(amplitude, 2.0), model="auto").model == "nonlinear"


@pytest.mark.parametrize("short", [1e-2, 1e-4, 1e-6, 1e-9])
def test_released_near_the_unstable_equilibrium(short: float) -> None:
    """The first quarter lasts as long as it likes, but there sin(psi) is psi: whatever rung is taken is right."""
    tilt = B6L.slenderness * (1.0 - short)
    auto, full = (simulate(B6L, initial_rotation=tilt, model=model) for model in ("auto", "nonlinear"))
    assert auto.outcome is full.outcome
    assert max(errors(auto, full)) <= TOLERANCE


def test_the_bound_never_asks_the_nonlinear_model(monkeypatch: pytest.MonkeyPatch) -> None:
    """`choose` is handed a solver of the simpler models only, and the compiled march is out of reach."""

    def forbidden(*_: object) -> None:
        raise RuntimeError("the nonlinear equation was solved")

    monkeypatch.setattr("twin.rocking.run.march_through", forbidden)
    choice = choose(problem(B6L, 0.93, None, 0.1, "nonlinear"), method("closed-form").solve)
    assert choice.model == "linearised"
    with pytest.raises(RuntimeError, match="was solved"):
        simulate(B6L, initial_rotation=0.1)


def test_the_free_tail_against_the_independent_integrator() -> None:
    """Flight by flight from the base at 0.8 and 0.81 of alpha: DOP853 lies between the bounds."""
    alpha, eta = B6L.slenderness, 0.8
    v = 0.8 * alpha
    for high in (1.0, 1.01):
        tail = free_tail(alpha, eta, v, v, high * v, quasi=False)
        assert tail is not None
        times, _ = scipy_reference(
            B6L, eta, None, (1e-300, high * v * P), (tail.simple[3] + tail.greatest[3]) / P + 0.01
        )
        later = np.array(times[:4]) * P - tail.simple[:4]
        assert np.all(later >= tail.least[:4] - 1e-9)
        assert np.all(later <= tail.greatest[:4] + 1e-9)
    assert free_tail(alpha, eta, alpha, alpha, alpha, quasi=False) is None


@pytest.mark.parametrize("eta", [0.0, 1.0])
def test_no_loss_and_no_rebound(eta: float) -> None:
    full = simulate(B6L, initial_rotation=0.05, restitution=eta, duration=3.0)
    auto = simulate(B6L, initial_rotation=0.05, restitution=eta, duration=3.0, model="auto")
    assert auto.outcome is full.outcome
    if auto.model != "nonlinear":
        assert max(errors(auto, full)) <= TOLERANCE


def test_a_run_cut_before_its_peak_stays_with_the_nonlinear_model() -> None:
    block, pulse = Block(0.02, 0.3), SineWave(2.0 * 9.81 / 15.0, 6.0)
    whole = simulate(block, pulse, model="auto")
    assert whole.model == "linearised"
    first = float(whole.impact_times[0])
    cut = simulate(block, pulse, duration=0.5 * first, model="auto")
    assert (cut.model, "cut before its peak" in cut.model_reason) == ("nonlinear", True)
    later = float(whole.impact_times[2]) * 1.02
    longer = simulate(block, pulse, duration=later, model="auto")
    assert longer.model == "linearised"
    assert longer.peak_rotation == pytest.approx(simulate(block, pulse, duration=later).peak_rotation, rel=TOLERANCE)


@pytest.mark.parametrize("tolerance", [0.0, 1.0, -0.1, math.nan])
def test_the_model_tolerance_is_a_share(tolerance: float) -> None:
    with pytest.raises(ValueError, match="model tolerance"):
        simulate(B6L, model="auto", model_tolerance=tolerance)


def test_the_default_is_the_nonlinear_model() -> None:
    response = simulate(B6L, constant(2.0, 0.05))
    assert (response.model, response.model_reason) == ("nonlinear", "nonlinear: asked for")
    asked = problem(B6L, 0.9, None, 0.1, "linearised")
    solution = method("closed-form").solve(asked)
    with pytest.raises(ValueError, match="is no simpler model"):
        model_error(replace(asked, model="nonlinear"), solution)
