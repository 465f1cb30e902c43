"""A bus is judged by how much goes wrong at a time, not by how much ever went wrong."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from devices.cia301.disturbance import MOST_ERRORS, MOST_STALE, WINDOW, Disturbances


def judged(totals: list[tuple[int, int]]) -> list[str | None]:
    bus = Disturbances()
    return [bus.judge(errors=errors, stale=stale) for errors, stale in totals]


@given(st.integers(0, 10**6), st.integers(0, 10**6))
def test_what_came_before_does_not_count(errors: int, stale: int) -> None:
    assert judged([(errors, stale)] * 500) == [None] * 500


@given(st.integers(WINDOW, 10 * WINDOW))
def test_rare_ones_are_taken(apart: int) -> None:
    assert judged([(k // apart, k // apart) for k in range(20 * apart)]) == [None] * (20 * apart)


@pytest.mark.parametrize(("what", "most", "words"), [(0, MOST_ERRORS, "error frames"), (1, MOST_STALE, "answers came")])
def test_many_at_a_time_are_found_with_the_first_too_many(what: int, most: int, words: str) -> None:
    found = judged([(k * (what == 0), k * (what == 1)) for k in range(WINDOW)])
    first = next(k for k, said in enumerate(found) if said)
    assert first == most + 1
    assert f"{most + 1} {words}" in str(found[first])
