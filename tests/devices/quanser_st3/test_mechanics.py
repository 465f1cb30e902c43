"""The saturated table: against DOP853 with events, and by energy, momentum and symmetry."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from devices.quanser_st3.mechanics import Mechanics, Span
from devices.quanser_st3.parameters import St3Parameters
from devices.quanser_st3.plant import St3Plant
from tests.devices.quanser_st3.hybrid import Automaton

H = 1e-3
HALF = 0.108


def swing(size: float, frequency: float, cycles: int) -> np.ndarray:
    return size * np.sin(math.tau * frequency * np.arange(cycles + 1) * H)


def ramp(speed: float, cycles: int) -> np.ndarray:
    return speed * H * np.arange(cycles + 1)


def mechanics(payload: float = 0.0, position: float = 0.0, **numbers: float) -> Mechanics:
    return Mechanics(St3Parameters(**numbers), payload, HALF, position)


def live(table: Mechanics, positions: np.ndarray) -> list[Span]:
    step = table.linear_step(H)
    return [span for x in positions for span in table.advance(step, float(x))]


@pytest.mark.parametrize(
    ("numbers", "payload", "positions", "events"),
    [
        ({"peak_current": 0.2, "delay": 0.0}, 20.0, swing(0.02, 4.0, 200), 4),
        ({"top_speed": 0.3, "delay": 0.0}, 0.0, swing(0.02, 4.0, 200), 4),
        ({"top_speed": 0.3, "peak_current": 0.3, "delay": 0.4e-3}, 20.0, swing(0.03, 3.0, 300), 4),
        ({"top_speed": 0.6, "delay": 0.0}, 50.0, ramp(0.5, 400), 12),
        ({"top_speed": 0.6, "delay": 2.3e-3, "peak_current": 1.0}, 50.0, ramp(-0.5, 400), 7),
    ],
    ids=["current", "speed", "current and speed", "switch and bumper", "all of it, to the other side"],
)
def test_against_an_integrator_with_events(
    numbers: dict[str, float], payload: float, positions: np.ndarray, events: int
) -> None:
    parameters = St3Parameters(**numbers)
    truth = Automaton(parameters, payload, HALF, positions, H)
    position, velocity = truth.run()
    assert truth.events >= events
    plant = St3Plant(parameters, H, np.random.default_rng(1), payload=payload, half_stroke=HALF)
    for x in positions[1:]:
        plant.advance(float(x))
    assert plant.position == pytest.approx(position, abs=1e-11)
    assert plant.velocity == pytest.approx(velocity, abs=1e-9)


@given(
    setpoints=st.lists(st.floats(-0.1, 0.1), min_size=1, max_size=30),
    payload=st.floats(0.0, 300.0),
    current=st.floats(0.1, 30.0),
    top=st.floats(0.05, 2.0),
)
@settings(max_examples=100, deadline=None)
def test_nothing_exceeds_what_the_motor_can_do(
    setpoints: list[float], payload: float, current: float, top: float
) -> None:
    table = mechanics(payload, peak_current=current, top_speed=top)
    most = St3Parameters(peak_current=current).largest_acceleration(payload)
    for span in live(table, np.array(setpoints)):
        # a regime ends up to 1e-13 s late
        assert max(abs(span.start), abs(span.end)) <= most * (1 + 1e-5)
        assert span.duration > 0.0
    assert abs(table.velocity) <= top * (1 + 1e-9)


@given(setpoints=st.lists(st.floats(-0.3, 0.3), min_size=1, max_size=40), payload=st.floats(0.0, 300.0))
@settings(max_examples=60, deadline=None)
def test_mirror_symmetry_and_no_time_lost(setpoints: list[float], payload: float) -> None:
    there, back = mechanics(payload), mechanics(payload)
    spans = live(there, np.array(setpoints))
    live(back, -np.array(setpoints))
    assert (there.position, there.velocity) == (-back.position, -back.velocity)
    assert sum(span.duration for span in spans) == pytest.approx(len(setpoints) * H, abs=1e-12 * len(setpoints))


@given(setpoints=st.lists(st.floats(-1e-4, 1e-4), min_size=1, max_size=40))
@settings(max_examples=60, deadline=None)
def test_what_stays_linear_is_the_closed_form_and_what_is_checked_is_the_same(setpoints: list[float]) -> None:
    """Far from every limit the two ways through a step agree, so that changing over between them is no event."""
    free, watched = mechanics(), mechanics()
    watched._calm = 0.0  # never sure that nothing saturates
    for x in setpoints:
        assert len(free.advance(free.linear_step(H), x)) == 1
        assert len(watched.advance(watched.linear_step(H), x)) > 1
    assert watched.position == pytest.approx(free.position, abs=1e-15)
    assert watched.velocity == pytest.approx(free.velocity, abs=1e-12)
    assert watched.acceleration == pytest.approx(free.acceleration, abs=1e-8)


@given(
    position=st.floats(-0.1, 0.1),
    velocity=st.floats(-1.0, 1.0),
    before=st.floats(-0.1, 0.1),
    after=st.floats(-0.1, 0.1),
)
@settings(max_examples=200, deadline=None)
def test_the_bound_on_a_linear_step_is_one(position: float, velocity: float, before: float, after: float) -> None:
    """Wherever a step is called linear, no instant of it breaks a limit."""
    table = mechanics(20.0)
    table.position, table.velocity, table.setpoint = position, velocity, before
    if not table._stays_linear(H, before, after):
        return
    loop = St3Parameters().loop(20.0)
    for part in np.linspace(0.02, 1.0, 50):
        middle = before + part * (after - before)
        x, v = table.linear_step(part * H).advance(position, velocity, before, middle)
        a = loop.angular_frequency**2 * (middle - x) - 2 * loop.damping * loop.angular_frequency * v
        assert abs(a) <= St3Parameters().largest_acceleration(20.0)
        assert abs(v) <= St3Parameters().top_speed
        assert abs(x) < HALF + St3Parameters().switch_distance


def test_without_power_friction_brakes_at_a_constant_rate() -> None:
    table = mechanics(12.26, friction=30.0)
    table.powered, table.velocity = False, 0.15
    live(table, np.zeros(200))
    # 20 kg: v^2 / (2 mu), mu = 1.5 m/s2
    assert table.position == pytest.approx(0.15**2 / 3.0, abs=1e-12)
    assert (table.velocity, table.acceleration) == (0.0, 0.0)
    position = table.position
    live(table, np.full(50, 0.05))
    assert table.position == position


def test_a_bumper_stops_every_table_and_takes_energy() -> None:
    p = St3Parameters()
    for payload, speed in itertools.product((0.0, 100.0), (0.2, 0.8)):
        table = mechanics(payload, position=HALF, friction=0.1)
        table.powered, table.velocity = False, speed
        mass = p.moving_mass + payload
        travel, fastest_back, hardest = HALF, 0.0, 0.0
        for _ in range(300):
            hardest = max(hardest, *(abs(s.start) for s in live(table, np.zeros(1))))
            travel = max(travel, table.position)
            fastest_back = min(fastest_back, table.velocity)
        assert 0.0 < -fastest_back < 0.9 * speed
        # without losses it would go in by v sqrt(M / k)
        depth = travel - HALF - p.bumper_distance
        assert 0.0 < depth < speed * math.sqrt(mass / p.bumper_stiffness)
        assert hardest < speed * (math.sqrt(p.bumper_stiffness / mass) + p.bumper_damping / mass) + 0.1 / mass


def test_a_limit_switch_takes_the_push_but_not_the_brake() -> None:
    table = mechanics(position=HALF)
    end = HALF + St3Parameters().switch_distance
    table.setpoint = HALF
    pushes = []
    for x in HALF + ramp(0.3, 60):
        there = table.position > end
        spans = live(table, np.array([x]))
        pushes += [span.start for span in spans if there]
    # on the far side the drive does not push on
    assert len(pushes) > 100
    assert max(pushes) <= 0.0
    # but it pushes back: a set-point inside brings the table home
    live(table, np.full(400, 0.0))
    assert table.position == pytest.approx(0.0, abs=1e-9)


def test_a_set_point_out_of_reach_ends_in_bounded_work() -> None:
    table = mechanics(100.0)
    spans = live(table, np.where(np.arange(500) % 2, 5.0, -5.0))
    assert len(spans) < 500 * 60
    assert abs(table.position) < HALF + 0.05
