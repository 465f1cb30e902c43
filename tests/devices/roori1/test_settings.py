"""What ROORI1 is set to for an asked double pulse, and what it refuses."""

from __future__ import annotations

from importlib.resources import files

import pytest
from hypothesis import given
from hypothesis import strategies as st

from devices.capacity_file import load_capacity
from devices.roori1.capacity import CAPACITY, MACHINE
from devices.roori1.settings import Roori1Machine
from excitation import ConstantPulse, CosineWave, DoublePulse, Record, ReleasedRun, SineWave, clip

MACHINE_OF_OXFORD = CAPACITY.machine
assert isinstance(MACHINE_OF_OXFORD, Roori1Machine)
TEXT = files("devices.roori1").joinpath("capacity.toml").read_text(encoding="utf-8")


@given(st.floats(0.076, 0.617), st.floats(0.0025, 0.035))
def test_every_published_pair_is_made_as_asked(velocity, gap) -> None:
    pulse = DoublePulse(velocity, gap, pulse_acceleration=300.0)
    clipped = clip(pulse, CAPACITY)
    assert clipped.feasible
    settings = MACHINE_OF_OXFORD.settings_for(pulse, CAPACITY, payload=None, coast=0.0)
    assert (settings.velocity, settings.gap, settings.pulse) == (velocity, gap, pulse)
    run = ReleasedRun(MACHINE_OF_OXFORD, settings.pulse)
    assert run.peak_velocity == pytest.approx(velocity, rel=1e-12)
    assert run.end_stop_position == pytest.approx(gap, rel=1e-12)
    # The shapers, as the closed form of the half sine: pi v / (2 T).
    assert run.peak_acceleration == pytest.approx(1.5707963267948966 * velocity / 0.005, rel=1e-9)
    assert run.peak_acceleration < CAPACITY.acceleration


@pytest.mark.parametrize(
    ("pulse", "sentence"),
    [
        (DoublePulse(0.07599, 0.02), "double pulse asks 0.07599 m/s; roori1 makes 0.076 m/s at least"),
        (DoublePulse(0.1, 0.00249), "double pulse asks a stop gap of 0.00249 m; roori1 has 0.0025 m at least"),
        (DoublePulse(0.1, 0.0351), "double pulse asks a stop gap of 0.0351 m; roori1 has 0.035 m at most"),
        (SineWave(2.0, 3.0), "roori1 makes pulses of kind double pulse only, no single sine"),
        (CosineWave(2.0, 3.0), "roori1 makes pulses of kind double pulse only, no single cosine"),
        (ConstantPulse(2.0, 0.1), "roori1 makes pulses of kind double pulse only, no constant pulse"),
        (Record([0.0, 1.0, 0.0], 0.1), "roori1 makes pulses of kind double pulse only, no record"),
    ],
)
def test_what_it_cannot_make_is_one_sentence(pulse, sentence) -> None:
    clipped = clip(pulse, CAPACITY, payload=2.5)
    assert clipped.given is None
    assert clipped.limits[0].sentence == sentence


def test_too_fast_is_scaled_to_the_fastest() -> None:
    clipped = clip(DoublePulse(0.8, 0.02), CAPACITY)
    assert clipped.limits[0].sentence == "double pulse asks 0.8 m/s of velocity; roori1 has 0.617 m/s"
    assert isinstance(clipped.given, DoublePulse)
    assert clipped.given.peak_velocity == pytest.approx(0.617, rel=1e-9)
    assert clipped.given.stop_gap == 0.02


def test_the_gap_is_said_before_what_scaling_for_it_would_do() -> None:
    clipped = clip(DoublePulse(0.3, 0.05), CAPACITY)
    assert clipped.given is None
    assert clipped.limits[0].sentence == "double pulse asks a stop gap of 0.05 m; roori1 has 0.035 m at most"


def test_friction_may_stop_the_base_before_its_stopper() -> None:
    rusty = MACHINE_OF_OXFORD.model_copy(update={"friction": 0.5})
    clipped = clip(DoublePulse(0.1, 0.03), CAPACITY.model_copy(update={"machine": rusty}))
    # 0.25 mm while struck, and v^2 / (2 f) = 10 mm.
    expected = "roori1: friction stops the base after 0.01025 m; the stop gap is 0.03 m"
    assert clipped.limits[0].sentence == expected
    with pytest.raises(ValueError, match="friction stops the base"):
        ReleasedRun(rusty, DoublePulse(0.1, 0.03))


def test_the_blow_may_last_longer_than_the_gap() -> None:
    soft = MACHINE_OF_OXFORD.model_copy(
        update={"striker": MACHINE_OF_OXFORD.striker.model_copy(update={"duration": 0.05})}
    )
    clipped = clip(DoublePulse(0.3, 0.005), CAPACITY.model_copy(update={"machine": soft}))
    assert clipped.limits[0].sentence == (
        "roori1: the base travels 0.0075 m while it is struck; the stop gap is 0.005 m"
    )


def test_a_cut_waveform_is_no_setting() -> None:
    clipped = clip(DoublePulse(0.3, 0.02, pulse_acceleration=400.0), CAPACITY, mode="saturate")
    assert clipped.given is None
    assert clipped.limits[0].sentence == "roori1 has two settings, which make no saturated double pulse"


def test_settings_in_words_and_numbers() -> None:
    settings = MACHINE_OF_OXFORD.settings_for(DoublePulse(0.3, 0.02), CAPACITY, payload=None, coast=0.0)
    assert settings.sentence == "launch for 0.3 m/s of the base; stop gap 20 mm"
    assert settings.numbers == {"peak_velocity_m_s": 0.3, "stop_gap_m": 0.02}
    with pytest.raises(ValueError, match="no single sine"):
        MACHINE_OF_OXFORD.settings_for(SineWave(1.0, 1.0), CAPACITY, payload=None, coast=0.0)


def test_shapes_and_times_are_the_users_to_change() -> None:
    own = TEXT.replace(
        'striker = { duration_s = 0.005, shape = "half sine" }', 'striker = { duration_s = 0.01, shape = "triangular" }'
    )
    machine = load_capacity(own, MACHINE).machine
    assert isinstance(machine, Roori1Machine)
    run = ReleasedRun(machine, DoublePulse(0.3, 0.02))
    assert run.peak_in(run.phases[1]) == pytest.approx(60.0)


def test_what_is_assumed_is_labelled() -> None:
    assumed = {key for key, source in CAPACITY.sources.items() if source.startswith("assumption")}
    assert assumed == {"stroke", "acceleration", "machine.striker", "machine.end_stop", "machine.friction_m_s2"}
