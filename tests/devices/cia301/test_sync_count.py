"""Cycles are counted by the sequence of one host, whatever else is heard."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from devices.cia301.frames import SYNC_COUNTS, sync_counter
from devices.cia301.sync_count import SyncCount

MOST = 21


def taken(counters: list[int], most: int = MOST) -> list[int | None]:
    count = SyncCount()
    return [count.take(counter, most) for counter in counters]


@given(st.lists(st.integers(1, MOST), min_size=1, max_size=300), st.integers(0, SYNC_COUNTS))
def test_gaps_are_counted_over_the_wrap(steps: list[int], first: int) -> None:
    cycles = [first]
    for step in steps:
        cycles.append(cycles[-1] + step)
    assert taken([sync_counter(cycle) for cycle in cycles]) == [None, *steps]


@given(st.integers(1, SYNC_COUNTS), st.integers(MOST + 1, SYNC_COUNTS - MOST - 1))
def test_a_second_master_of_the_same_rate_does_not_speed_up_time(first: int, apart: int) -> None:
    """The two sequences never come within reach of each other: cycles passed are those of the first."""
    counters = [sync_counter(cycle) for k in range(500) for cycle in (first + k, first + k + apart)]
    passed = taken(counters)[1:]
    assert sum(step or 0 for step in passed) == 499
    assert set(passed[0::2]) == {0}
    assert set(passed[1::2]) == {1}


@given(st.integers(1, SYNC_COUNTS), st.integers(1, SYNC_COUNTS - MOST - 1))
def test_an_old_sync_is_passed_over(first: int, age: int) -> None:
    count = SyncCount()
    assert count.take(sync_counter(first + 300), MOST) is None
    assert count.take(sync_counter(first + 300 - age), MOST) == 0
    assert count.astray
    assert count.take(sync_counter(first + 301), MOST) == 1
    assert not count.astray


def test_a_new_sequence_is_taken_up_with_its_third() -> None:
    assert taken([1, 2, 100, 101, 102, 103]) == [None, 1, 0, 0, 1, 1]


def test_after_another_clock_the_next_one_begins() -> None:
    count = SyncCount()
    count.take(7, MOST)
    count.forget()
    assert count.take(200, MOST) is None
    assert not count.astray
