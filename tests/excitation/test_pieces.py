"""Closed forms of pieces against quadrature, series and dense sampling."""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from excitation.extremes import extremes, steps
from excitation.pieces import PieceTable, as_spans, assemble, steady

NODES, WEIGHTS = 0.5 * (np.polynomial.legendre.leggauss(40) + np.array([[1.0], [0.0]]))

number = st.floats(-10.0, 10.0)
span = st.tuples(
    st.floats(0.01, 2.0),
    number,
    number,
    st.one_of(st.just(0.0), number),
    st.floats(0.01, 20.0),
    st.floats(-7.0, 7.0),
)
tables = st.lists(span, min_size=1, max_size=6).map(lambda spans: PieceTable(assemble(spans)))


def by_quadrature(table: PieceTable, t: float) -> tuple[float, float]:
    """Velocity and displacement at `t` from the definition of the pieces, integrated by Gauss-Legendre."""
    v = x = 0.0
    for t0, t1, c0, c1, a, omega, psi in table.rows:
        end = min(t1, t)
        if end <= t0:
            break
        s = (end - t0) * NODES
        acceleration = c0 + c1 * s + a * np.sin(omega * s + psi)
        weights = (end - t0) * WEIGHTS
        x += v * (end - t0) + float(weights @ ((end - t0 - s) * acceleration))
        v += float(weights @ acceleration)
    return v, x


@given(tables, st.floats(0.0, 1.0))
def test_velocity_and_displacement_are_the_integrals_of_the_acceleration(table: PieceTable, share: float) -> None:
    t = share * table.boundaries[-1]
    v, x = by_quadrature(table, t)
    assert table.velocity(t) == pytest.approx(v, rel=1e-11, abs=1e-11)
    assert table.displacement(t) == pytest.approx(x, rel=1e-11, abs=1e-11)


@given(tables)
def test_extremes_bound_every_sample_and_are_attained(table: PieceTable) -> None:
    found = extremes(table)
    t = np.linspace(0.0, table.boundaries[-1], 2001)[:-1]
    step = t[1]
    a, v, x = table.acceleration(t), table.velocity(t), table.displacement(t)
    assert found.acceleration[0] <= a.min() + 1e-9
    assert found.acceleration[1] >= a.max() - 1e-9
    assert found.velocity >= np.abs(v).max() - 1e-9
    assert found.displacement[0] <= x.min() + 1e-9
    assert found.displacement[1] >= x.max() - 1e-9
    peak = max(map(abs, found.acceleration))
    assert np.abs(v).max() >= found.velocity - peak * step - 1e-9
    assert x.max() >= found.displacement[1] - found.velocity * step - 1e-9
    assert x.min() <= found.displacement[0] + found.velocity * step + 1e-9
    piece = np.searchsorted(table.boundaries, t, side="right")
    slopes = np.abs(np.diff(a))[piece[1:] == piece[:-1]]
    assert slopes.max(initial=0.0) <= found.jerk * step + 1e-9


def test_extremes_of_a_sine_on_a_slope_meet_their_closed_form() -> None:
    # a = 1 + 2 sin s on [0, 2 pi]: v = s + 2 (1 - cos s), greatest where sin s = -1/2, that is s = 7 pi / 6.
    found = extremes(PieceTable(assemble([(2.0 * math.pi, 1.0, 0.0, 2.0, 1.0, 0.0)])))
    s = 7.0 * math.pi / 6.0
    assert found.velocity == pytest.approx(s + 2.0 * (1.0 - math.cos(s)), rel=1e-15)
    assert found.acceleration == pytest.approx((-1.0, 3.0), rel=1e-15)
    assert found.jerk == pytest.approx(2.0, rel=1e-15)
    assert found.jump == pytest.approx(1.0, rel=1e-15)


@given(st.floats(1e-9, 40.0))
@settings(max_examples=50)
def test_displacement_of_a_sine_keeps_every_digit_however_short(q: float) -> None:
    # x = (A / omega^2) (q - sin q), by its Taylor series in exact rational numbers
    exact, term, n, argument = Fraction(0), Fraction(q), 1, Fraction(q)
    while n < 20 or abs(term) > Fraction(1, 10**40):
        term = -term * argument * argument / ((n + 1) * (n + 2))
        exact -= term
        n += 2
        term = Fraction(float(term)) if n > 160 else term
    table = PieceTable(assemble([(q, 0.0, 0.0, 3.0, 1.0, 0.0)]))
    assert table.end[2] == pytest.approx(3.0 * float(exact), rel=2e-15)


@pytest.mark.parametrize("psi", [0.0, 0.3, math.pi / 2])
def test_a_minute_piece_keeps_its_digits(psi: float) -> None:
    omega, tau = 1e-4, 1e-3
    table = PieceTable(assemble([(tau, 0.0, 0.0, 1.0, omega, psi)]))
    v = math.sin(psi) * tau + omega * math.cos(psi) * tau**2 / 2
    x = math.sin(psi) * tau**2 / 2 + omega * math.cos(psi) * tau**3 / 6
    assert table.end[1] == pytest.approx(v, rel=1e-13)
    assert table.end[2] == pytest.approx(x, rel=1e-13)


def test_outside_the_pieces_there_is_no_acceleration_and_the_motion_goes_on() -> None:
    table = PieceTable(assemble([steady(2.0, 3.0)]))
    t = np.array([-5.0, 0.0, 2.0, 4.0])
    assert table.acceleration(t).tolist() == [0.0, 3.0, 0.0, 0.0]
    assert table.velocity(t).tolist() == [0.0, 0.0, 6.0, 6.0]
    assert table.displacement(t).tolist() == [0.0, 0.0, 6.0, 18.0]


def test_steps_of_rounding_are_no_jumps() -> None:
    table = PieceTable(assemble([(1.0, 0.0, 0.0, 2.0, 2.0 * math.pi, 0.0), (1.0, 0.0, 0.0, 2.0, 2.0 * math.pi, 0.0)]))
    assert 0.0 < np.abs(steps(table)).max() < 1e-14
    assert extremes(table).jump == 0.0


@given(tables)
def test_spans_and_rows_are_inverse(table: PieceTable) -> None:
    again = assemble(as_spans(table.rows))
    assert np.allclose(again, table.rows, rtol=1e-13, atol=1e-13)


def test_a_span_too_short_for_the_clock_is_left_out() -> None:
    assert len(assemble([steady(1.0, 1.0), steady(1e-20, 1.0), steady(1.0, 1.0)])) == 2


@pytest.mark.parametrize(
    ("rows", "message"),
    [
        (np.zeros((0, 7)), "shape"),
        (np.zeros((2, 6)), "shape"),
        ([[0.0, math.nan, 0.0, 0.0, 0.0, 0.0, 0.0]], "finite"),
        ([[1.0, 2.0, 0.0, 0.0, 0.0, 0.0, 0.0]], "from time 0"),
        ([[0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]], "from time 0"),
        ([[0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0], [1.5, 2.0, 0.0, 0.0, 0.0, 0.0, 0.0]], "without a gap"),
        ([[0.0, 1.0, 0.0, 0.0, 1.0, 0.0, 0.0]], "angular frequency"),
    ],
)
def test_malformed_pieces_are_refused(rows: object, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        PieceTable(rows)  # type: ignore[arg-type]


@pytest.mark.parametrize("t", [math.nan, math.inf, -math.inf])
def test_a_time_that_is_not_finite_is_refused(t: float) -> None:
    table = PieceTable(assemble([steady(1.0, 1.0)]))
    for ask in (table.acceleration, table.velocity, table.displacement):
        with pytest.raises(ValueError, match="time must be finite"):
            ask(np.array([0.0, t]))
