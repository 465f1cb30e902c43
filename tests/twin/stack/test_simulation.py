"""Runs of two and three blocks: histories, chatter, what falls and how a run ends."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from excitation import ConstantPulse
from tests.facts import B6L, sine
from twin import Block, Outcome, Stack, simulate
from twin.stack.response import Ending
from twin.stack.simulation import simulate_stack

PAIR = Stack([B6L, B6L])


def test_nothing_moves_under_the_threshold() -> None:
    response = simulate(PAIR, ConstantPulse(PAIR.uplift_acceleration, 1.0))
    assert (response.outcome, response.mode, response.ending) == (Outcome.STAYED, "none", Ending.AT_REST)
    assert response.configurations == ((0.0, (0, 0)),)
    assert response.rest_time is None
    assert not response.rotations([0.0, 0.5, 2.0]).any()
    assert simulate(PAIR, ConstantPulse(1.001 * PAIR.uplift_acceleration, 1.0)).outcome is not Outcome.STAYED


def test_opens_by_the_corner_it_reached() -> None:
    """A slow sine opens the base about the -x corner, later the upper interface about the other: no rate jumps."""
    response = simulate(PAIR, sine(1.2, 1.0))
    (_, rest), (uplift, first), (opening, second), *_ = response.configurations
    assert (rest, first, second) == ((0, 0), (-1, 0), (-1, 1))
    before = response.angular_velocities(np.nextafter(opening, 0.0))
    assert response.angular_velocities(opening) == pytest.approx(before, abs=1e-12)
    assert response.angular_velocities(uplift) == pytest.approx([0.0, 0.0], abs=1e-12)
    later = response.rotations(opening + 1e-3)
    assert later[0] < later[1] < 0.0


def test_a_jump_opens_both_interfaces() -> None:
    response = simulate(PAIR, ConstantPulse(25.0, 0.05))
    assert response.configurations[1] == (0.0, (-1, 1))


def test_free_rocking_ends_at_rest() -> None:
    """Hundreds of impacts, several chatters; energy only falls, and the losses add up to what there was."""
    response = simulate(PAIR, initial_rotation=[0.02, 0.05])
    assert (response.ending, response.mode) == (Ending.AT_REST, "none")
    assert response.rest_time is not None
    assert all(impact.candidates == 1 for impact in response.impacts)
    losses = np.array([impact.energy_lost for impact in response.impacts])
    assert np.all(losses >= 0.0)
    m, g = B6L.mass or 0.0, B6L.gravity

    def lift(theta: float, x: float, z: float) -> float:
        return -x * math.sin(theta) + z * math.cos(theta)

    lower = lift(0.02, -0.03, 0.135) - 0.135
    # The upper pivot stands straight above the lower one.
    upper = lift(0.02, 0.0, 0.27) - 0.27 + lift(0.05, -0.03, 0.135) - 0.135
    start = m * g * (lower + upper)
    assert float(losses.sum()) == pytest.approx(start, rel=1e-12)
    assert response.rotations(response.rest_time + 1.0) == pytest.approx([0.0, 0.0], abs=0.0)
    assert response.end_time == math.inf


def test_chatter_ends_in_sticking() -> None:
    """The upper interface's rebounds shrink by two ratios in turn until it sticks; the lower block goes on rocking."""
    response = simulate(PAIR, initial_rotation=[0.02, 0.05])
    rebounds = [i for i in response.impacts if i.interface == 1 and 0.22 < i.time < 0.26]
    closing = np.array([abs(i.rates_before[1] - i.rates_before[0]) for i in rebounds])
    tail = closing[(closing > 1e-9) & (closing < 1e-4)]
    assert len(tail) > 10
    assert np.ptp(tail[2:] / tail[:-2]) < 0.02
    assert np.max(tail[1:] / tail[:-1]) < 0.9
    assert len(response.impacts) < 3000


@pytest.mark.parametrize("rule", ["unilateral", "angular-momentum"])
def test_mirror_symmetry(rule: str) -> None:
    stack = Stack([Block(0.09, 0.2), Block(0.06, 0.27), Block(0.07, 0.1)])
    for amplitude in (1.3, 2.4, 5.0):
        one = simulate(stack, sine(amplitude, 2.5), impact_rule=rule, pulling_pivot="falls")
        other = simulate(stack, sine(-amplitude, 2.5), impact_rule=rule, pulling_pivot="falls")
        assert [(t, tuple(-sign for sign in signs)) for t, signs in one.configurations] == list(other.configurations)
        sampled = np.linspace(0.0, min(one.end_time, 2.0), 20)
        assert np.array_equal(one.rotations(sampled), -other.rotations(sampled))
        assert [fall.time for fall in one.overturnings] == [fall.time for fall in other.overturnings]


def test_the_top_falls_and_the_rest_goes_on() -> None:
    response = simulate(PAIR, sine(5.2, 4.0), pulling_pivot="pulls")
    assert response.mode == "all"
    assert [fall.blocks for fall in response.overturnings] == [(1,), (0,)]
    top, bottom = response.overturnings
    assert top.time < bottom.time
    after = response.rotations([top.time, 0.5 * (top.time + bottom.time), bottom.time + 1.0])
    assert np.all(after[:, 1] == top.rotations[0])
    assert abs(after[2, 0]) == pytest.approx(0.5 * math.pi)
    assert np.all(response.angular_velocities(bottom.time + 1.0) == 0.0)


def test_a_pivot_that_would_have_to_pull() -> None:
    pulse = sine(3.0, 3.0)
    ends = simulate(Stack([B6L]), pulse)
    assert (ends.ending, ends.outcome, ends.mode) == (Ending.CONTACT_LOST, Outcome.OVERTURNED, "all")
    assert ends.lost_contact is not None
    assert (ends.lost_contact.interface, ends.lost_contact.falling_from) == (0, 0)
    assert ends.end_time == ends.lost_contact.time
    assert 1.2 < abs(ends.rotations(ends.end_time)[0]) < 1.5
    falls = simulate(Stack([B6L]), pulse, pulling_pivot="falls")
    (fall,) = falls.overturnings
    assert fall.lost_contact
    assert fall.time == ends.end_time
    with pytest.raises(ValueError, match="the motion is known from 0 to"):
        ends.rotations(ends.end_time + 0.1)


def test_the_rules_of_impact_give_different_runs() -> None:
    """An upper block rocking alone: by the thesis' rule the lower one never moves."""
    stack = Stack([Block(0.07, 0.27), Block(0.06, 0.27)])
    kept = simulate(stack, initial_rotation=[0.0, 0.1], impact_rule="angular-momentum")
    assert {signs for _, signs in kept.configurations} == {(0, 1), (0, -1), (0, 0)}
    single = simulate(B6L, initial_rotation=0.1)
    assert kept.rest_time == pytest.approx(single.rest_time, abs=1e-9)
    moved = simulate(stack, initial_rotation=[0.0, 0.1])
    assert [signs for _, signs in moved.configurations[:3]] == [(0, 1), (-1, -1), (1, -1)]
    assert moved.configurations[1][0] == kept.configurations[1][0]


def test_a_duration_ends_the_run() -> None:
    response = simulate(PAIR, initial_rotation=[0.02, 0.05], duration=0.1)
    assert (response.ending, response.end_time) == (Ending.DURATION, 0.1)
    whole = simulate(PAIR, initial_rotation=[0.02, 0.05])
    assert response.rotations(0.1) == pytest.approx(whole.rotations(0.1), abs=1e-14)


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        ({"initial_rotation": [0.1]}, "initial rotation has the shape"),
        ({"initial_rotation": 2.0}, "initial rotation is 2 rad; it must lie inside -pi/2 to pi/2"),
        ({"initial_angular_velocity": [math.nan, 0.0]}, "initial angular velocity must be finite"),
        ({"duration": 0.0}, "duration is 0 s"),
        ({"tolerance": 0.0}, "tolerance is 0 rad"),
        ({"impact_rule": "guess"}, "there is no impact rule 'guess'"),
        ({"pulling_pivot": "glue"}, "there is no pulling pivot 'glue'"),
        ({"restitution": 0.5}, "a stack has its own restitution"),
        ({"method": "rk4"}, "a stack has its own restitution and one method"),
    ],
)
def test_refusals(arguments: dict[str, object], sentence: str) -> None:
    with pytest.raises(ValueError, match=sentence):
        simulate(PAIR, **arguments)  # type: ignore[call-overload]


def test_a_block_takes_no_settings_of_a_stack() -> None:
    with pytest.raises(ValueError, match="are for a stack"):
        simulate(B6L, impact_rule="unilateral")  # type: ignore[call-overload]
    with pytest.raises(ValueError, match="one block has one initial rotation"):
        simulate(B6L, initial_rotation=[0.1, 0.1])  # type: ignore[call-overload]


SIZES = st.tuples(st.floats(0.04, 0.08), st.floats(0.2, 0.4))


@settings(max_examples=25)
@given(
    sizes=st.lists(SIZES, min_size=1, max_size=3),
    amplitude=st.floats(0.5, 8.0),
    frequency=st.floats(0.5, 6.0),
)
def test_every_run_ends_and_says_how(sizes: list[tuple[float, float]], amplitude: float, frequency: float) -> None:
    stack = Stack([Block(width, height) for width, height in sizes])
    pulse = sine(amplitude, frequency)
    response = simulate_stack(stack, pulse, pulling_pivot="falls", tolerance=1e-6)
    assert response.ending is not Ending.UNFINISHED
    times = [impact.time for impact in response.impacts]
    assert times == sorted(times)
    assert all(impact.energy_lost >= -1e-15 for impact in response.impacts if impact.candidates == 1)
    for fall in response.overturnings:
        assert fall.time <= response.end_time
    sampled = response.rotations(np.linspace(0.0, min(response.end_time, 5.0), 30))
    assert np.all(np.isfinite(sampled))
    assert np.all(np.max(np.abs(sampled), axis=0) <= np.maximum(response.peak_rotations, 0.5 * math.pi) + 1e-12)
