"""A bad line: what comes out of it is what went in, but for what the fault says."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest

from devices.clock import ManualClock
from devices.faults.catalogue import parse_fault
from devices.faults.schedule import Schedule
from devices.faults.traffic import BadLine

FRAMES = [(0x200 + k % 3, bytes([k])) for k in range(40)]


def through(text: str, seed: int = 1) -> list[tuple[int, bytes]]:
    schedule = Schedule([parse_fault(text)], ManualClock(), 1.0)
    schedule.start()
    line = BadLine(schedule, np.random.default_rng(seed))
    out = [arrived for frame in FRAMES for arrived in line.carry(frame)]
    return out + line.flush()


def test_a_good_line_changes_nothing() -> None:
    assert through("bus_off@0") == FRAMES


def test_lost_frames_are_lost_and_the_others_keep_their_order() -> None:
    out = through("frames_dropped@0:0.5")
    assert 10 < len(out) < 30
    assert out == [frame for frame in FRAMES if frame in out]
    assert through("frames_dropped@0:1") == []
    assert through("frames_dropped@0:0") == FRAMES


def test_a_spoiled_frame_differs_in_one_bit() -> None:
    out = through("frames_corrupted@0:1")
    assert [identifier for identifier, _ in out] == [identifier for identifier, _ in FRAMES]
    for (_, sent), (_, came) in zip(FRAMES, out, strict=True):
        assert bin(sent[0] ^ came[0]).count("1") == 1


@pytest.mark.parametrize("distance", [0, 1, 2, 5])
def test_copies_come_so_many_frames_later(distance: int) -> None:
    out = through(f"frames_duplicated@0:{distance}")
    last = FRAMES[len(FRAMES) - distance :] if distance else []
    assert Counter(out) == Counter(FRAMES * 2) - Counter(last)  # whose copies are still on the way
    for frame in FRAMES[: len(FRAMES) - distance]:
        first = out.index(frame)
        between = out[first + 1 : out.index(frame, first + 1)]
        originals = [other for k, other in enumerate(between) if other not in out[: first + 1 + k]]
        assert len(originals) == distance


def test_neighbours_change_places() -> None:
    out = through("frames_reordered@0")
    assert out == [FRAMES[k + 1 - 2 * (k % 2)] for k in range(len(FRAMES))]


def test_a_frame_without_a_neighbour_is_not_lost() -> None:
    schedule = Schedule([parse_fault("frames_reordered@0")], ManualClock(), 1.0)
    schedule.start()
    line = BadLine(schedule, np.random.default_rng(1))
    assert line.carry(FRAMES[0]) == []
    assert line.flush() == [FRAMES[0]]
    assert line.flush() == []


def test_equal_seeds_equal_faults() -> None:
    assert through("frames_dropped@0:0.5", 7) == through("frames_dropped@0:0.5", 7)
    assert through("frames_dropped@0:0.5", 7) != through("frames_dropped@0:0.5", 8)
