"""The default method against DOP853 at 1e-12, over blocks, restitutions and every kind of pulse."""

from __future__ import annotations

import math

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from excitation import ConstantPulse, CosineWave, DoublePulse, Motion, Pulse, Record, SineWave
from twin import Block, Outcome, simulate
from twin.rocking.restitution import Improved

blocks = st.builds(Block, width=st.floats(0.03, 0.3), height=st.floats(0.2, 1.0))
restitutions = st.one_of(st.none(), st.floats(0.2, 0.98), st.builds(Improved, st.floats(0.1, 1.0)))
KINDS = ("sine", "cosine", "lasting sine", "constant", "double pulse", "record", "motion")


@st.composite
def pulse_on(draw: st.DrawFn, block: Block) -> Pulse:
    """Draw a pulse of any kind, scaled to the block: accelerations in g tan(alpha), times in 1/p."""
    limit, p = block.uplift_acceleration, block.frequency_parameter
    kind = draw(st.sampled_from(KINDS))
    amplitude = draw(st.floats(0.8, 5.0)) * draw(st.sampled_from([1.0, -1.0])) * limit
    hertz = draw(st.floats(0.4, 6.0)) * p / (2 * math.pi)
    if kind == "constant":
        return ConstantPulse(amplitude, draw(st.floats(0.1, 2.0)) / p)
    if kind == "double pulse":
        speed = draw(st.floats(0.2, 1.5)) * limit / p
        gap = speed * draw(st.floats(0.3, 1.5)) / p
        return DoublePulse(speed, gap, draw(st.floats(0.0, 0.6)), draw(st.floats(8.0, 40.0)) * limit)
    if kind == "record":
        values = draw(st.lists(st.floats(-3.0, 3.0), min_size=4, max_size=12))
        return Record(np.array([0.0, *values, 0.0]) * limit, draw(st.floats(0.1, 0.5)) / p)
    if kind == "cosine":
        return CosineWave(amplitude, hertz, draw(st.sampled_from([0.5, 1.0, 1.25])))
    if kind == "motion":
        return Motion(SineWave(amplitude, hertz), 0.5 * limit, settle=0.1)
    return SineWave(amplitude, hertz, 3.0 if kind == "lasting sine" else draw(st.sampled_from([0.5, 1.0])))


@st.composite
def scenes(draw: st.DrawFn) -> tuple[Block, Pulse, float | Improved | None, float]:
    block = draw(blocks)
    tilt = draw(st.sampled_from([0.0, 0.0, 0.3, -0.6])) * block.slenderness
    return block, draw(pulse_on(block)), draw(restitutions), tilt


@given(scenes())
@settings(max_examples=40, deadline=None)
def test_the_default_is_dop853_at_1e_12(scene: tuple[Block, Pulse, float | Improved | None, float]) -> None:
    block, pulse, restitution, tilt = scene
    p = block.frequency_parameter
    duration = pulse.duration + 1.0 / p
    arguments = {"restitution": restitution, "initial_rotation": tilt, "duration": duration}
    default = simulate(block, pulse, **arguments)
    reference = simulate(block, pulse, **arguments, method="dop853", tolerance=1e-12)
    assert Outcome.UNDECIDED in (default.outcome, reference.outcome) or default.outcome is reference.outcome
    if reference.rotation_error > 1e-6:
        return  # the reference itself says that it does not know
    slack = 1e-10 + 2.0 * reference.rotation_error + default.rotation_error
    t = np.linspace(0.0, min(default.end_time, reference.end_time, duration), 200)
    assert np.max(np.abs(np.asarray(default.rotation(t)) - np.asarray(reference.rotation(t)))) <= slack
    strong = [np.abs(r.impact_rates) * r.restitution > 1e-3 * p for r in (default, reference)]
    times, others = default.impact_times[strong[0]], reference.impact_times[strong[1]]
    if len(times) == len(others) and len(times):
        # An instant is known as well as the rotation there, over the rate.
        assert np.all(np.abs(times - others) * np.abs(default.impact_rates[strong[0]]) <= slack)


@given(scenes())
@settings(max_examples=40, deadline=None)
def test_fixed_steps_state_their_error(scene: tuple[Block, Pulse, float | Improved | None, float]) -> None:
    block, pulse, restitution, tilt = scene
    p = block.frequency_parameter
    duration = pulse.duration + 1.0 / p
    arguments = {"restitution": restitution, "initial_rotation": tilt, "duration": duration}
    default = simulate(block, pulse, **arguments)
    for method in ("rk4", "newmark"):
        found = simulate(block, pulse, **arguments, method=method, step=0.01 / p)
        assert Outcome.UNDECIDED in (default.outcome, found.outcome) or default.outcome is found.outcome
        if found.outcome is Outcome.UNDECIDED or default.outcome is Outcome.UNDECIDED:
            continue
        t = np.linspace(0.0, min(default.end_time, found.end_time, duration), 100)
        error = np.max(np.abs(np.asarray(default.rotation(t)) - np.asarray(found.rotation(t))))
        assert error <= 3.0 * found.rotation_error + 1e-9
