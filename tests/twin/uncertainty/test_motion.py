"""Base motions as pieces: through samples, later, cut, side by side; and transfer functions from files."""

from __future__ import annotations

import cmath
import contextlib
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from excitation import SineWave
from twin.errors import InputError
from twin.uncertainty.motion import BaseMotion, cut_at, delayed, pieces_through, stacked
from twin.uncertainty.table import LinearResponse, read_transfer


def test_few_pieces_through_smooth_samples_keep_shape_and_momentum() -> None:
    t = np.arange(600) * 1e-3
    a = 3.0 * np.sin(2 * math.pi * 4.0 * t) * np.exp(-3.0 * t)
    motion = BaseMotion(pieces_through(a, 1e-3))
    assert len(motion.pieces) < 100
    assert np.max(np.abs(motion.acceleration(t[:-2]) - a[:-2])) < 0.01
    v = np.concatenate([[0.0], np.cumsum(0.5 * (a[1:] + a[:-1]) * 1e-3)])
    assert np.max(np.abs(motion.velocity(t) - v)) < 1e-4


@given(st.lists(st.floats(-10.0, 10.0), min_size=3, max_size=200))
def test_any_samples_make_contiguous_pieces(samples: list[float]) -> None:
    rows = pieces_through(np.array(samples), 1e-3)
    assert rows[0, 0] == 0.0
    assert np.array_equal(rows[1:, 0], rows[:-1, 1])
    assert np.all(rows[:, 1] > rows[:, 0])
    assert np.isfinite(rows).all()


def test_later_and_cut_it_is_the_same_motion() -> None:
    pulse = SineWave(2.0, 3.0)
    t = np.linspace(0.0, 0.5, 400)
    later = BaseMotion(delayed(pulse.pieces, 0.1))
    assert later.acceleration(t + 0.1) == pytest.approx(np.asarray(pulse.acceleration(t)), abs=1e-9)
    assert delayed(pulse.pieces, 0.0) is pulse.pieces
    cut = BaseMotion(cut_at(pulse.pieces, np.array([0.05, 0.11, 0.3, 0.6])))
    assert cut.duration == 0.6
    assert cut.acceleration(t) == pytest.approx(np.asarray(pulse.acceleration(t)), abs=1e-9)


def test_side_by_side_the_shorter_stand_still() -> None:
    pulse = SineWave(2.0, 3.0)
    both = stacked([pulse.pieces, cut_at(pulse.pieces, np.array([0.1, 0.2]))])
    assert both.shape == (2, 3, 7)
    BaseMotion(both[0])  # checks that the pieces are contiguous
    assert BaseMotion(both[0]).velocity(1.0) == pytest.approx(0.0, abs=1e-12)


def test_a_table_that_halves_and_turns() -> None:
    table = read_transfer("frequency_hz, gain, phase_deg\n0, 0.5, 0\n100, 0.5, 0\n", "half.csv")
    made = BaseMotion(table.made(SineWave(2.0, 3.0).pieces))
    t = np.linspace(0.02, 0.3, 200)
    assert made.acceleration(t) == pytest.approx(np.asarray(SineWave(1.0, 3.0).acceleration(t)), abs=0.01)


def test_a_phase_is_unwrapped() -> None:
    delay = 0.02
    rows = [f"{f},1,{math.degrees(cmath.phase(cmath.exp(-2j * math.pi * f * delay)))}" for f in range(0, 60, 2)]
    table = read_transfer("frequency_hz,gain,phase_deg\n" + "\n".join(rows), "late.csv")
    assert table.response(13.0) == pytest.approx(cmath.exp(-2j * math.pi * 13.0 * delay), abs=1e-9)


@pytest.mark.parametrize(
    "text",
    [
        "",
        "a,b,c\n1,2,3",
        "frequency_hz,gain,phase_deg\n",
        "frequency_hz,gain,phase_deg\n1,2",
        "frequency_hz,gain,phase_deg\n1,x,3",
        "frequency_hz,gain,phase_deg\n2,1,0\n1,1,0",
        "frequency_hz,gain,phase_deg\n1,nan,0",
        "frequency_hz,gain,phase_deg\n1,-1,0",
    ],
)
def test_no_transfer_function(text: str) -> None:
    with pytest.raises(InputError, match=r"transfer function t\.csv"):
        read_transfer(text, "t.csv")


@given(st.text(max_size=200))
def test_any_text_is_a_table_or_one_sentence(text: str) -> None:
    with contextlib.suppress(InputError):
        assert isinstance(read_transfer(text, "t.csv"), LinearResponse)
