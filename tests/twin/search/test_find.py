"""Proposed runs: inside the capacity whatever the device and the seed, and what the known boundaries say."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from devices.catalogue import find_device
from devices.quanser_st3.capacity import CAPACITY as ST3
from devices.setpoints import first_refusal
from excitation import Capacity, clip
from tests.facts import BOUNDARIES, LIMIT, P
from twin.campaign import parse_campaign
from twin.errors import InputError
from twin.live import set_points
from twin.rehearsal import brake_of
from twin.rocking.response import Outcome
from twin.scene import load_scene, parse_scene
from twin.search.family import significant
from twin.search.find import Effort, Search, find_runs
from twin.search.goals import Aim, Goal
from twin.search.proposal import Proposal
from twin.search.report import as_data, run_parts, sentences

QUICK = Effort(sizes=28, shapes=8, futures=200)
SCENES = {"quanser_st3": ("b6l_sine", "b6l_cosine"), "air_track": ("b6l_constant",), "roori1": ("b6l_double_pulse",)}
SURE = """
[uncertainty]
restitution = { spread = 0.0 }
slenderness_percent = { spread = 0.0 }
size_percent = { spread = 0.0 }
initial_tilt_deg = { spread = 0.0 }
[uncertainty.table]
gain_percent = { spread = 0.0 }
"""


def wide(**limits: float) -> Capacity:
    """A table on which hardly anything binds."""
    return Capacity(name="wide", **{"stroke": 20.0, "velocity": 20.0, "acceleration": 200.0, **limits})


def sine(frequency: float, amplitude: float = 1.0, extra: str = "") -> str:
    """Return a scene of block B6L under one sine of dimensionless frequency and amplitude."""
    return f"""
        [block]
        width_mm = 60
        height_mm = 270
        [excitation]
        kind = "sine"
        amplitude_m_s2 = {amplitude * LIMIT!r}
        frequency_hz = {frequency * P / (2.0 * math.pi)!r}
        [table]
        device = "quanser_st3"
        settle_s = 0.1
        {extra}
    """


def scene_of(text: str):
    return parse_scene(text, name="mine", folder=Path())


def check_inside(proposal: Proposal, capacity: Capacity) -> None:
    """The clip, asked afresh, changes nothing; and the device takes every set-point of the whole run."""
    scene = proposal.scene
    pulse = scene.pulse()
    assert pulse is not None
    brake = None if capacity.machine is not None else brake_of(scene, capacity)
    clipped = clip(pulse, capacity, brake=brake, coast=scene.table.coast_s, payload=scene.block.mass_kg)
    assert clipped.feasible
    assert clipped.given is pulse
    assert not clipped.limits
    assert max(clipped.usage.values()) <= 1.0 + 1e-12
    motion = proposal.rehearsal.motion
    assert motion.pulse is not None
    if capacity.machine is None:
        cycle = 1.0 / scene.twin.cycle_hz
        points = set_points(motion, proposal.rehearsal.after, cycle)
        assert first_refusal(capacity, cycle, 1e-9, motion.displacement(0.0), points.tolist()) is None
        t = np.linspace(0.0, motion.duration, 4001)
        assert np.max(np.abs(motion.displacement(t))) <= 0.5 * capacity.stroke * (1.0 + 1e-9)
        assert np.max(np.abs(motion.velocity(t))) <= capacity.velocity * (1.0 + 1e-9)
        assert np.max(np.abs(motion.acceleration(t))) <= capacity.acceleration * (1.0 + 1e-9)
    else:
        settings_ = proposal.rehearsal.settings
        assert settings_ is not None
        assert capacity.machine.refusals(pulse, capacity.name, scene.block.mass_kg) == []
        assert motion.peak_velocity <= capacity.velocity * (1.0 + 1e-9)


@st.composite
def tables(draw: st.DrawFn) -> tuple[str, str, Capacity]:
    """A device, a scene for it, and a capacity that is some share of the device's own."""
    device = draw(st.sampled_from(sorted(SCENES)))
    name = draw(st.sampled_from(SCENES[device]))
    own = find_device(device).capacity
    share = st.floats(0.15, 2.0)
    update: dict[str, object] = {key: getattr(own, key) * draw(share) for key in ("stroke", "velocity", "acceleration")}
    if device == "quanser_st3":
        update["frequency"] = draw(st.none() | st.floats(1.0, 20.0))
        update["payload"] = draw(st.none() | st.floats(1.0, 50.0))
        update["jerk"] = draw(st.none() | st.floats(50.0, 1e4))
    return device, name, own.model_copy(update=update)


@settings(max_examples=12, suppress_health_check=[HealthCheck.too_slow])
@given(table=tables(), seed=st.integers(0, 2**31), aim=st.sampled_from([Aim.OVERTURN, Aim.NO_IMPACT, Aim.SAFE]))
def test_no_proposal_ever_exceeds_the_capacity(table: tuple[str, str, Capacity], seed: int, aim: Aim) -> None:
    _, name, capacity = table
    try:
        search = find_runs(load_scene(name), capacity, Goal(aim), most=3, seed=seed, effort=QUICK)
    except InputError:
        return
    for proposal in search.proposals:
        check_inside(proposal, capacity)
    json.dumps(as_data(search), allow_nan=False)


def test_the_safe_amplitude_is_below_the_first_boundary_not_in_the_gap_above_it() -> None:
    first, again, direct = sorted(a for w, a, _ in BOUNDARIES if w == 4)[:3]
    scene = scene_of(sine(4.0, extra=SURE))
    search = find_runs(scene, wide(acceleration=7.0 * LIMIT), Goal(Aim.SAFE), effort=QUICK)
    (proposal,) = search.proposals
    assert 0.99 * first < proposal.size / LIMIT < first
    unsafe = proposal.numbers["first_unsafe_size"]
    assert isinstance(unsafe, float)
    assert unsafe / LIMIT == pytest.approx(first, rel=0.006)
    # Between 5.07 and 5.30 g tan(alpha) it stands again: said, and not proposed.
    (gap,) = search.remarks
    assert "gap of stability, not proposed" in gap
    assert again < direct


def test_overturning_without_impact_is_found_where_the_boundaries_have_it() -> None:
    scene = scene_of(sine(2.0, extra=SURE))
    search = find_runs(scene, wide(velocity=1.2), Goal(Aim.NO_IMPACT), most=3, effort=Effort(48, 16, 200))
    assert search.proposals
    assert [p.score for p in search.proposals] == sorted((p.score for p in search.proposals), reverse=True)
    for proposal in search.proposals:
        response = proposal.rehearsal.response
        assert response.outcome is Outcome.OVERTURNED
        assert response.overturning_time is not None
        assert not [t for t in response.impact_times if t < response.overturning_time]
        assert "overturns without impact in" in proposal.why
    places = [(p.size, p.shape) for p in search.proposals]
    for k, one in enumerate(places):
        for other in places[k + 1 :]:
            assert math.hypot(math.log(one[0] / other[0]), math.log(one[1] / other[1])) > 0.05


def test_what_is_out_of_reach_is_said_with_its_limit() -> None:
    search = find_runs(load_scene("b6l_sine"), ST3, Goal(Aim.NO_IMPACT), effort=Effort(48, 16, 200))
    assert not search.proposals
    (why,) = search.remarks
    assert "no sine inside the capacity of quanser_st3 does it" in why
    assert "quanser_st3 has" in why
    assert sentences(search)[-1] == "verdict    no run"


def test_rocking_far_is_safe() -> None:
    search = find_runs(load_scene("b6l_sine"), ST3, Goal(Aim.ROCK), most=2, effort=Effort(40, 10, 1200))
    assert search.proposals
    for proposal in search.proposals:
        check_inside(proposal, ST3)
        assert proposal.rehearsal.response.outcome is Outcome.ROCKED
        assert proposal.overturning.high < 0.01
        assert proposal.rehearsal.response.peak_rotation > 0.3 * proposal.rehearsal.block.slenderness


def test_restitutions_are_told_apart_by_runs_that_stay_up() -> None:
    scene = load_scene("b6l_sine")
    search = find_runs(scene, ST3, Goal(Aim.SEPARATE), most=2, restitution=0.9, effort=Effort(18, 9, 400))
    assert search.proposals
    for proposal in search.proposals:
        check_inside(proposal, ST3)
        assert "sigma apart" in proposal.why
    best = search.proposals[0].numbers["sigmas"]
    assert isinstance(best, float)
    assert best > 3.0
    assert "stays up" in search.proposals[0].why


@pytest.mark.parametrize(
    ("restitution", "said"),
    [(None, "give the measured one"), (1.5, "from 0 to 1"), (0.929411764705882, "nothing to tell apart")],
)
def test_restitutions_that_cannot_be_told_apart(restitution: float | None, said: str) -> None:
    with pytest.raises(InputError, match=said):
        find_runs(load_scene("b6l_sine"), ST3, Goal(Aim.SEPARATE), restitution=restitution, effort=QUICK)


@pytest.mark.parametrize(
    ("scene", "goal", "said"),
    [
        ("b6l_free", Goal(Aim.OVERTURN), "has no excitation"),
        ("b6l_constant", Goal(Aim.OVERTURN, at=2.0), "has no frequency"),
    ],
)
def test_what_cannot_be_searched(scene: str, goal: Goal, said: str) -> None:
    loaded = load_scene(scene)
    with pytest.raises(InputError, match=said):
        find_runs(loaded, find_device(loaded.table.device).capacity, goal, effort=QUICK)


def test_equal_seeds_give_equal_proposals() -> None:
    def found(seed: int) -> Search:
        goal = Goal(Aim.OVERTURN, at=3.0)
        return find_runs(load_scene("b6l_sine"), ST3, goal, most=2, seed=seed, effort=QUICK)

    one, same = found(3), found(3)
    assert as_data(one) == as_data(same)
    assert one.proposals


def test_a_campaign_of_proposals_leaves_out_levels_the_machine_cannot_be_set_to() -> None:
    scene = load_scene("b6l_double_pulse")
    search = find_runs(scene, find_device("roori1").capacity, Goal(Aim.OVERTURN), most=1, effort=Effort(28, 20, 200))
    runs, notes = run_parts(search, (10.0, 100.0))
    assert [run.levels_percent for run in runs] == [(100.0,)]
    assert "cannot make 10 % of it" in notes[0]
    assert runs[0].excitation == search.proposals[0].scene.excitation


@given(value=st.floats(1e-6, 1e6), digits=st.integers(1, 8))
def test_rounding_down_never_grows(value: float, digits: int) -> None:
    rounded = significant(value, digits, down=True)
    assert rounded <= value
    assert rounded >= value * (1.0 - 10.0 ** (1 - digits)) - 1e-300
    assert float(f"{rounded:.{digits - 1}e}") == rounded


def test_the_campaign_text_of_a_search_reads_back() -> None:
    from twin.campaign import campaign_text

    search = find_runs(load_scene("b6l_sine"), ST3, Goal(Aim.OVERTURN, at=3.0), most=1, effort=QUICK)
    runs, notes = run_parts(search, (10.0, 100.0))
    assert not notes
    text = campaign_text("found", "b6l_sine", runs, (10.0, 100.0), Path())
    campaign = parse_campaign(text, name="c", folder=Path())
    assert campaign.steps[-1].scene.excitation == search.proposals[0].scene.excitation
    assert [step.level for step in campaign.steps] == [10.0, 100.0]
