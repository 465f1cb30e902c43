"""A run checked from its first moment to its last, against `simulate` and against what can be worked out by hand."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from devices.air_track.capacity import CAPACITY as AIR_TRACK
from devices.air_track.plant import AirTrackPlant
from devices.air_track.settings import AirTrackMachine, AirTrackSettings
from devices.quanser_st3.capacity import CAPACITY as ST3
from devices.released_parameters import MeasuringParameters
from devices.roori1.capacity import CAPACITY as ROORI1
from excitation import Pulse, ReleasedRun
from tests.facts import B6L, LIMIT
from tests.twin.conftest import FREE, short_scene
from twin.commands.mechanics import mechanics_of
from twin.foresight import REACTION_CYCLES
from twin.rehearsal import Rehearsal, rehearse
from twin.rocking.compiled import FloatArray
from twin.rocking.response import Outcome
from twin.scene import Scene, load_scene, parse_scene
from twin.simulation import simulate
from twin.whole_run.check import WholeRun, check_whole_run
from twin.whole_run.mechanics import TableMechanics
from twin.whole_run.outcome import (
    FALLS_EITHER_WAY,
    SAVES,
    STANDS_EITHER_WAY,
    TOPPLES,
    StopStudy,
)
from twin.whole_run.performed import Followed
from twin.whole_run.words import whole_run_data, whole_run_lines

OUTCOMES = {Outcome.STAYED: 0, Outcome.ROCKED: 0, Outcome.OVERTURNED: 1}


@dataclass(frozen=True)
class Pieces(Pulse):
    """Any rows as a pulse."""

    rows: tuple[tuple[float, ...], ...]

    @property
    def family(self) -> str:
        return "pieces"

    @property
    def kind(self) -> str:
        return "pieces"

    def scaled(self, factor: float) -> Pieces:
        raise NotImplementedError

    def _rows(self) -> FloatArray:
        return np.array(self.rows)


def sine_scene(amplitude_g: float, frequency: float, kind: str = "sine") -> Scene:
    return parse_scene(
        f"""
        [block]
        width_mm = 60
        height_mm = 270
        mass_kg = 2.5692
        [excitation]
        kind = "{kind}"
        amplitude_g = {amplitude_g}
        frequency_hz = {frequency}
        [table]
        device = "quanser_st3"
        settle_s = 0.3
        """,
        name="mine",
        folder=Path(),
    )


def checked(scene: Scene) -> tuple[Rehearsal, WholeRun]:
    rehearsal = rehearse(scene, ST3)
    return rehearsal, check_whole_run(rehearsal, mechanics_of(scene, ST3))


def stopped(rehearsal: Rehearsal, whole: WholeRun, study: StopStudy, k: int) -> Pieces:
    """Return the whole base motion of the k-th stop: the run up to the decision, then the stop's own rows."""
    base = Followed(rehearsal.motion, whole.mechanics, 1e-3, rehearsal.after).base.pieces
    time = float(study.times[k])
    before = base[base[:, 0] < time].copy()
    before[-1, 1] = min(before[-1, 1], time)
    rows = np.concatenate([before, study.stops[k].rows]) if len(study.stops[k].rows) else before
    return Pieces(tuple(map(tuple, rows.tolist())))


def test_every_stop_ends_as_simulate_says() -> None:
    # The overturning sine, and one that stands but that friction alone would topple.
    for scene, how in ((sine_scene(0.36, 4.0), "ramp_down"), (sine_scene(0.25, 1.5), "power_cut")):
        rehearsal, whole = checked(scene)
        study: StopStudy = getattr(whole, how)
        changes = np.flatnonzero(np.diff(study.outcomes.astype(int)))
        assert changes.size > 0
        near = [k + d for k in changes.tolist() for d in (-1, 0, 1, 2)]
        for k in sorted({*near, *range(150, len(study.times), 500)}):
            response = simulate(B6L, stopped(rehearsal, whole, study, k))
            assert OUTCOMES[response.outcome] == study.outcomes[k], (how, float(study.times[k]))


def test_a_stop_before_the_block_lifts_saves_it_and_one_after_it_lies_does_not() -> None:
    rehearsal, whole = checked(sine_scene(0.36, 4.0))
    study = whole.ramp_down
    assert study is not None
    lifts = whole.response.uplift_time
    lies = whole.response.overturning_time
    assert lifts is not None
    assert lies is not None
    reaction = REACTION_CYCLES * 1e-3
    for time, comparison in zip(study.times.tolist(), study.comparisons, strict=True):
        # Nothing of the pulse is felt yet but what lifts no block.
        if time < rehearsal.motion.pulse_start - reaction:
            assert comparison == SAVES
        if time > lies:
            assert comparison == FALLS_EITHER_WAY
    assert [interval.comparison for interval in study.intervals] == [SAVES, FALLS_EITHER_WAY]
    assert study.of(SAVES)[0].end > lifts


def test_friction_alone_topples_a_block_that_the_run_leaves_standing() -> None:
    _, whole = checked(sine_scene(0.25, 1.5))
    cut, ramp = whole.power_cut, whole.ramp_down
    assert cut is not None
    assert ramp is not None
    (interval,) = cut.of(TOPPLES)
    assert 0.05 < interval.end - interval.start < 0.5
    assert [found.comparison for found in ramp.intervals] == [STANDS_EITHER_WAY]
    text = "\n".join(whole_run_lines(whole))
    assert f"from {interval.start:.3f} to {interval.end:.3f} s: STOPPING TOPPLES" in text


def test_a_table_that_follows_exactly_ramps_down_in_closed_form() -> None:
    rehearsal = rehearse(sine_scene(0.3, 4.0), ST3)
    whole = check_whole_run(rehearsal)
    study = whole.ramp_down
    assert study is not None
    assert whole.power_cut is None
    time, stop = study.longest
    act = time + REACTION_CYCLES * 1e-3
    speed = abs(rehearsal.motion.velocity(act))
    gentle = 0.5 * LIMIT
    assert stop.duration == pytest.approx(REACTION_CYCLES * 1e-3 + speed / gentle, rel=1e-6)
    assert stop.rows[-1, 2] == pytest.approx(-math.copysign(gentle, rehearsal.motion.velocity(act)))
    for k in range(0, len(study.times), 97):
        response = simulate(B6L, stopped(rehearsal, whole, study, k)) if k else rehearsal.response
        assert OUTCOMES[response.outcome] == study.outcomes[k]


@settings(max_examples=12, deadline=None)
@given(amplitude=st.floats(0.05, 0.95), frequency=st.floats(0.6, 9.0), kind=st.sampled_from(("sine", "cosine")))
def test_no_stop_leaves_the_soft_limits(amplitude: float, frequency: float, kind: str) -> None:
    _, whole = checked(sine_scene(amplitude, frequency, kind))
    assert whole.ramp_down is not None
    assert whole.stays_inside
    assert all(stop.beyond == 0.0 for stop in whole.ramp_down.stops)
    assert all(math.isfinite(stop.duration) and stop.duration >= 0.0 for stop in whole.ramp_down.stops)
    # The intervals are the run, cut: each moment is in exactly one.
    intervals = whole.ramp_down.intervals
    assert intervals[0].start == whole.ramp_down.times[0]
    assert intervals[-1].end == whole.ramp_down.times[-1]
    assert all(a.end < b.start for a, b in pairwise(intervals))
    json.dumps(whole_run_data(whole), allow_nan=False)


def test_positioning_does_not_rock_and_the_loop_overshoots_a_cosine() -> None:
    _, whole = checked(sine_scene(0.6, 2.0, "cosine"))
    moves = whole.positioning
    assert moves is not None
    assert not moves.lifts
    assert moves.performed.acceleration == pytest.approx(0.5 * LIMIT, rel=0.02)
    pulse = next(phase for phase in whole.phases if phase.name == "pulse")
    # A jump of the command: a loop with zeta = 0.68 overshoots it by exp(-pi zeta / sqrt(1 - zeta^2)) at most.
    zeta = whole.mechanics.damping
    assert 0.0 < pulse.overshoot < math.exp(-math.pi * zeta / math.sqrt(1.0 - zeta * zeta))
    assert "overshoots its command" in "\n".join(whole_run_lines(whole))


def test_a_loop_slow_and_loose_enough_rocks_the_block_while_positioning() -> None:
    rehearsal = rehearse(sine_scene(0.3, 4.0), ST3)
    whole = check_whole_run(rehearsal, TableMechanics(frequency=4.0, damping=0.15, mass=10.0))
    moves = whole.positioning
    assert moves is not None
    assert moves.lifts
    assert "IT ROCKS IT" in "\n".join(whole_run_lines(whole))


def test_energies_at_the_end_stops() -> None:
    _, whole = checked(sine_scene(0.3, 4.0))
    by_name = {impact.what: impact for impact in whole.impacts}
    assert by_name["ramp-down"].energy == 0.0
    # 0.234 m/s are braked by 30 N within 10 mm; 90 mm are left.
    assert by_name["power lost"].energy == 0.0
    assert by_name["the drive runs away at its top speed"].energy == pytest.approx(0.5 * (7.74 + 2.5692) * 0.8**2)
    slippery = whole.mechanics
    loose = TableMechanics(
        frequency=slippery.frequency, damping=slippery.damping, bumper=0.118, friction=0.1, mass=slippery.mass
    )
    lost = {i.what: i for i in check_whole_run(rehearse(sine_scene(0.3, 4.0), ST3), loose).impacts}["power lost"]
    # v^2 - 2 (F / m) room, from the fastest moment on.
    assert lost.time is not None
    assert 0.2 < lost.speed < 0.2345
    assert lost.energy == pytest.approx(0.5 * (7.74 + 2.5692) * lost.speed**2)


def test_the_contact_in_a_stop_is_that_of_validity() -> None:
    rehearsal, whole = checked(sine_scene(0.3, 4.0))
    study = whole.power_cut
    assert study is not None
    k = int(np.argmin(np.abs(study.times - study.asked.normal_time)))
    base = stopped(rehearsal, whole, study, k)
    judged = simulate(B6L, base).validity()
    # Looked at where rows begin and end: never more than the extreme, and no more than a few percent from it.
    assert study.asked.normal >= judged.least_normal - 1e-9
    assert study.asked.normal == pytest.approx(judged.least_normal, abs=0.03)
    assert study.asked.friction == pytest.approx(whole.mechanics.braking / 9.81, rel=0.05)


def test_free_rocking_has_nothing_to_stop() -> None:
    rehearsal = rehearse(short_scene(FREE, "initial_rotation_deg = 5"), ST3)
    whole = check_whole_run(rehearsal, mechanics_of(rehearsal.scene, ST3))
    assert whole.ramp_down is not None
    assert [interval.comparison for interval in whole.ramp_down.intervals] == [STANDS_EITHER_WAY]
    assert max(stop.duration for stop in whole.ramp_down.stops) == 0.0
    whole_run_lines(whole)


def test_the_air_track_is_stopped_as_its_emulator_is() -> None:
    rehearsal = rehearse(load_scene("b6l_constant"), AIR_TRACK)
    whole = check_whole_run(rehearsal)
    study, run, machine, settings_ = whole.ramp_down, rehearsal.motion, AIR_TRACK.machine, rehearsal.settings
    assert study is not None
    assert isinstance(run, ReleasedRun)
    assert isinstance(machine, AirTrackMachine)
    assert isinstance(settings_, AirTrackSettings)
    for time in (1.02, 1.1, 1.5, 3.0, 5.05):
        k = int(np.argmin(np.abs(study.times - time)))
        plant = AirTrackPlant(
            machine,
            settings_,
            rehearsal.scene.block.mass_kg or 0.0,
            MeasuringParameters(release_delay=0.0),
            1e-3,
            np.random.default_rng(1),
        )
        plant.release()
        for _ in range(round((float(study.times[k]) - run.pulse_start) / 1e-3)):
            plant.advance()
        plant.air = False
        began = plant.position
        for _ in range(4000):
            plant.advance()
        assert study.stops[k].distance == pytest.approx(plant.position - began, abs=2e-4), time


def test_nothing_stops_roori1() -> None:
    rehearsal = rehearse(load_scene("b6l_double_pulse"), ROORI1)
    whole = check_whole_run(rehearsal)
    assert whole.ramp_down is None
    assert "nothing stops this machine" in "\n".join(whole_run_lines(whole))
    (impact,) = whole.impacts
    assert impact.energy is None
    assert impact.speed == pytest.approx(0.1505, abs=1e-3)
    json.dumps(whole_run_data(whole), allow_nan=False)
