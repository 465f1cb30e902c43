"""The futures of a plan: probability, causes, boundaries, levels; the scene's table of what is not known."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from devices.air_track.capacity import CAPACITY as AIR_TRACK
from devices.quanser_st3.capacity import CAPACITY as ST3
from devices.quanser_st3.parameters import St3Parameters
from devices.roori1.capacity import CAPACITY as ROORI1
from excitation import Capacity
from tests.closed_loop import ClosedLoop
from tests.facts import LIMIT, P
from twin.errors import InputError
from twin.rehearsal import Rehearsal, rehearse
from twin.rocking.run import parameters
from twin.scene import Scene, load_scene, parse_scene, parse_scene_json
from twin.simulation import overturns
from twin.uncertainty.foresee import Uncertain, foresee
from twin.uncertainty.motion import BaseMotion, scaled
from twin.uncertainty.population import CAUSES, Population
from twin.uncertainty.probability import Probability
from twin.uncertainty.shaking import shaking_of
from twin.uncertainty.table import AS_ASKED, LinearResponse
from twin.uncertainty.words import data, lines

LOOP = LinearResponse(St3Parameters().loop(2.5).response, "by the loop")
STILL = """
restitution = { spread = 0.0 }
slenderness_percent = { spread = 0.0 }
size_percent = { spread = 0.0 }
initial_tilt_deg = { spread = 0.0 }
"""


def scene_of(extra: str = "", amplitude: float = 1.2, frequency: float = 2.0, block: str = "") -> Scene:
    """Return a scene with a sine of dimensionless A and W on B6L; `extra` is of `[uncertainty]`."""
    text = f"""
        [block]
        width_mm = 60
        height_mm = 270
        {block}
        [excitation]
        kind = "sine"
        amplitude_m_s2 = {amplitude * LIMIT!r}
        frequency_hz = {frequency * P / (2 * math.pi)!r}
        [table]
        device = "quanser_st3"
        [uncertainty]
        {extra}
    """
    return parse_scene(text, name="mine", folder=Path())


def rehearsed(extra: str = "futures = 300", *, capacity: Capacity = ST3, **more: object) -> Rehearsal:
    return rehearse(scene_of(extra, **more), capacity)  # type: ignore[arg-type]


def seen(extra: str = "futures = 300", **more: object) -> Uncertain:
    return foresee(rehearsed(extra, **more))  # type: ignore[arg-type]


def test_without_any_spread_every_future_is_the_prediction() -> None:
    for amplitude, share in ((1.2, 0.0), (1.25, 1.0)):
        found = seen(f"futures = 50{STILL}table.gain_percent.spread = 0.0", amplitude=amplitude)
        assert found.probability.estimate == share
        assert found.causes == ()
        peaks = [response.peak_rotation for response in found.responses]
        assert peaks == pytest.approx([found.nominal.peak_rotation] * 40, rel=1e-9)


def test_the_probability_is_that_of_the_accurate_solver_one_by_one() -> None:
    rehearsal = rehearsed("futures = 120")
    population = Population.of(rehearsal)
    rows = rehearsal.motion.shaking.pieces
    fell = 0
    for k in range(120):
        body = parameters(population.block(k, rehearsal.block), float(population.bodies[k, 3]))
        rotation = float(population.rotations[k])
        fell += overturns(body, scaled(rows, float(population.factors[k])), rotation=rotation) is True
    assert population.probability(rows) == Probability(120, fell)
    assert 0 < fell < 120


def test_futures_repeat_with_their_seed_and_are_the_first_of_more() -> None:
    rehearsal = rehearsed()
    few, many = Population.of(rehearsal, 20), Population.of(rehearsal, 50)
    assert np.array_equal(few.bodies, many.first(20).bodies)
    assert not np.array_equal(few.bodies, Population.of(rehearsal, 20, seed=9).bodies)
    fixed = Population.of(rehearsal, 20, restitution=0.9)
    assert np.all(fixed.bodies[:, 3] == 0.9)
    assert np.array_equal(fixed.blocks, few.blocks)


@pytest.mark.parametrize("cause", CAUSES)
def test_a_cause_alone_at_its_mean(cause: str) -> None:
    rehearsal = rehearsed()
    usual, without = Population.of(rehearsal, 30), Population.of(rehearsal, 30, without=cause)
    k = CAUSES.index(cause)
    assert np.all(without.values[:, k] == 0.0)
    assert np.array_equal(np.delete(without.values, k, 1), np.delete(usual.values, k, 1))


def test_uniform_and_shifted_spreads() -> None:
    extra = (
        "futures = 4000\nrestitution = { low = 0.8, high = 0.9 }\nslenderness_percent = { mean = 2.0, spread = 0.1 }"
    )
    population = Population.of(rehearsed(extra))
    eta, alpha = population.bodies[:, 3], population.bodies[:, 0]
    assert 0.8 <= eta.min() < 0.801
    assert 0.899 < eta.max() <= 0.9
    assert eta.mean() == pytest.approx(0.85, abs=0.002)
    assert alpha.mean() == pytest.approx(1.02 * rehearsed().block.slenderness, rel=1e-4)


def test_the_size_goes_into_p_and_the_gain_into_the_motion() -> None:
    population = Population.of(rehearsed("futures = 100\nsize_percent = { mean = 10.0, spread = 0.0 }"))
    assert population.bodies[:, 1] == pytest.approx(P / math.sqrt(1.1), rel=1e-12)
    gained = Population.of(rehearsed("futures = 100\ntable.gain_percent = { mean = -5.0, spread = 0.0 }"))
    assert gained.factors == pytest.approx(0.95)


def test_the_causes_name_what_matters() -> None:
    extra = f"futures = 2000{STILL}".replace(
        "slenderness_percent = { spread = 0.0 }", "slenderness_percent.spread = 2.0"
    )
    found = seen(f"{extra}table.gain_percent.spread = 0.05")
    assert [cause.name for cause in found.causes] == ["slenderness", "table gain"]
    first, second = found.causes
    assert first.without.estimate == 0.0
    assert (first.share or 0.0) > 0.9 > 0.1 > (second.share or 0.0)
    assert 0.1 < found.probability.estimate < 0.9


def test_boundaries_are_the_known_ones() -> None:
    found = seen("futures = 50", amplitude=1.2)
    assert found.amplitude is not None
    assert found.amplitude.up == pytest.approx(1.221298881120159 / 1.2 - 1.0, abs=2e-6)
    assert found.frequency is not None
    # At the boundary in frequency the outcome really changes: the sine itself is made faster or slower.
    for change in (found.frequency.down, found.frequency.up):
        if change is not None:
            outcomes = [
                rehearsed(amplitude=1.2, frequency=2.0 * (1.0 + change * (1.0 + d))).response.outcome
                for d in (-1e-4, 1e-4)
            ]
            assert outcomes[0] != outcomes[1]


def test_levels_lie_where_they_say() -> None:
    rehearsal = rehearsed("futures = 2000", amplitude=1.1)
    found = foresee(rehearsal)
    half = found.levels[0.5]
    assert half is not None
    p = Population.of(rehearsal).scaled(half).probability(rehearsal.motion.shaking.pieces)
    assert p.estimate == pytest.approx(0.5, abs=0.1)
    low = found.levels[0.01]
    assert low is not None
    assert low < half


def test_a_linear_table_makes_what_its_plant_makes() -> None:
    rehearsal = rehearsed("futures = 1")
    pulse = rehearsal.motion.shaking
    loop = St3Parameters(delay=0.0).loop()
    made = LinearResponse(loop.response, "loop").made(pulse.pieces)
    plant = ClosedLoop(loop.angular_frequency, loop.damping, 1e-4, 0.0)
    motion = BaseMotion(made)
    error = momentum = 0.0
    for k in range(1, 5000):
        plant.advance(pulse.displacement(k * 1e-4))
        error = max(error, abs(plant.acceleration - motion.acceleration(k * 1e-4)))
        momentum = max(momentum, abs(plant.velocity - motion.velocity(k * 1e-4)))
    assert error < 0.02 * pulse.peak_acceleration
    assert momentum < 0.003 * pulse.peak_velocity
    assert len(made) < 120


def test_the_loop_changes_the_probability_a_little_and_is_named() -> None:
    rehearsal = rehearsed("futures = 400")
    found = foresee(rehearsal, LOOP)
    assert found.table == "by the loop"
    assert abs(found.probability.estimate - foresee(rehearsal).probability.estimate) < 0.3


def test_noise_is_a_cause_and_has_its_size() -> None:
    rehearsal = rehearsed("futures = 400\ntable.noise_m_s2 = 0.2")
    shaking = shaking_of(rehearsal, AS_ASKED)
    t = np.linspace(0.05, 0.35, 500)
    plain = BaseMotion(shaking.made).acceleration(t)
    noise = np.array([BaseMotion(rows).acceleration(t) - plain for rows in shaking.variants])
    assert float(np.sqrt(np.mean(noise**2))) == pytest.approx(0.2, rel=0.05)
    assert shaking_of(rehearsal, AS_ASKED, without="table noise").variants.shape[0] == 1
    assert "table noise" in [cause.name for cause in foresee(rehearsal).causes]


def test_a_delay_matters_only_to_a_block_let_go_before() -> None:
    extra = "futures = 100\ntable.delay_ms.spread = 5.0"
    assert shaking_of(rehearsed(extra), AS_ASKED).spread == ()
    tilted = rehearsed(extra, block="initial_rotation_deg = 5")
    assert shaking_of(tilted, AS_ASKED).spread == ("table delay",)
    assert foresee(tilted).start == 0.0


@pytest.mark.parametrize(("name", "capacity"), [("b6l_constant", AIR_TRACK), ("b6l_double_pulse", ROORI1)])
def test_released_machines(name: str, capacity: Capacity) -> None:
    rehearsal = rehearse(load_scene(name), capacity)
    found = foresee(rehearsal)
    assert found.probability.count == 10_000
    assert all(math.isfinite(response.peak_rotation) for response in found.responses)
    json.dumps(data(found), allow_nan=False)


def test_free_rocking_has_no_boundary() -> None:
    found = foresee(rehearse(load_scene("b6l_free"), ST3))
    assert found.amplitude is found.frequency is None
    assert found.levels == {0.01: None, 0.5: None}
    assert not any("table gain" in line for line in lines(found))


def test_words() -> None:
    said = "\n".join(lines(seen("futures = 1000")))
    for word in ("overturning in", " of 1000; ", "without the spread of", "of amplitude", "base motion as asked"):
        assert word in said
    assert max(map(len, said.splitlines())) < 220


@pytest.mark.parametrize(
    ("extra", "said"),
    [
        ("restitution = { low = 0.9 }", "low"),
        ("restitution = { spread = 0.1, low = 0.9, high = 1.0 }", "uniform"),
        ("restitution = { low = 0.95, high = 0.9 }", "must not be above"),
        ("restitution = { spred = 0.1 }", "did you mean spread"),
        ("table.respons = 'asked'", "did you mean response"),
        ("table.response = 'file'", "response_file"),
        ("table.response_file = 'a.csv'", "response_file"),
        ("size_percent = { spread = -1.0 }", "greater than or equal to 0"),
        ("future = 3", "did you mean futures"),
    ],
)
def test_what_makes_no_sense_is_one_sentence(extra: str, said: str) -> None:
    with pytest.raises(InputError) as caught:
        scene_of(extra)
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)


def test_an_old_scene_keeps_its_spreads_and_a_recorded_one_opens() -> None:
    scene = load_scene("b6l_sine")
    spreads = scene.spreads
    assert spreads.restitution.deviation == scene.twin.restitution_spread
    assert spreads.futures == scene.twin.futures
    old = json.loads(scene.model_dump_json())
    del old["uncertainty"]
    again = parse_scene_json(json.dumps(old), name="old", folder=Path())
    # A recording has every number in it, so that it counts as asked for.
    assert again.spreads.model_dump(exclude={"asked"}) == spreads.model_dump(exclude={"asked"})


@given(st.integers(1, 3000).flatmap(lambda n: st.tuples(st.just(n), st.integers(0, n))))
def test_the_interval_holds_its_estimate(numbers: tuple[int, int]) -> None:
    p = Probability(*numbers)
    assert 0.0 <= p.low <= p.estimate <= p.high <= 1.0
    assert p.low < p.high


def test_undecided_futures_count_to_both_ends() -> None:
    sure, unsure = Probability(100, 10), Probability(100, 10, 5)
    assert unsure.low == sure.low
    assert unsure.high == Probability(100, 15).high
    assert unsure.estimate == pytest.approx(0.125)
