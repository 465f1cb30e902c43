"""The board's sampling as the clock of a run."""

from __future__ import annotations

import math

import numpy as np
import pytest

from devices.clock import ManualClock
from devices.errors import DriveStopped
from devices.quanser_st3.hil_driver import open_table
from devices.quanser_st3.hil_table import HilTable
from tests.devices.quanser_st3.quanser_board import MovingBoard, module

H = 1e-3
WIRED: dict[str, object] = {"board": "q8_usb", "amperes_per_volt": 2.0}


def opened(board: MovingBoard) -> HilTable:
    table = open_table(WIRED, hardware=module(board), clock=board.clock)
    table.enable(0.0)
    return table


def run(table: HilTable, cycles: int, stall: dict[int, float] | None = None) -> tuple[list[int], list[float]]:
    """Cycle as `twin.live` does; return the cycles that were done, and how late each was."""
    begin, there = table.clock.now(), table.position
    done: list[int] = []
    lateness: list[float] = []
    k = 0
    while k < cycles:
        late = table.clock.wait_until(begin + k * H)
        if gone := int(late / H):
            k += gone
            continue
        table.exchange(k, there + 0.01 * (1 - math.cos(math.tau * k * H)) / 2)
        done.append(k)
        lateness.append(late)
        if stall and k in stall:
            table._wall.advance(stall[k])  # type: ignore[attr-defined]
        k += 1
    return done, lateness


@pytest.mark.parametrize("drift", [-150e-6, 0.0, 150e-6])
def test_two_clocks_that_drift_cost_no_cycle(drift: float) -> None:
    """20 s at 150 ppm are three whole cycles; samples are read as they come, never an old one."""
    board = MovingBoard(ManualClock(), drift=drift)
    table = opened(board)
    done, lateness = run(table, 20000)
    assert done == list(range(20000))
    assert max(lateness) < 0.01 * H
    assert len(board._samples) <= 1
    table.close()


def test_a_late_host_skips_what_is_over_and_reads_what_has_piled_up() -> None:
    board = MovingBoard(ManualClock())
    table = opened(board)
    done, lateness = run(table, 200, stall={50: 3.4e-3, 120: 0.5e-3})
    # 3.4 ms late: cycles 51 and 52 are over, 53 begins late
    assert [k for k in range(200) if k not in done] == [51, 52]
    assert lateness[done.index(53)] == pytest.approx(0.4e-3, abs=0.05e-3)
    assert lateness[done.index(54)] < 0.05e-3
    assert max(lateness[done.index(60) :]) < 0.05e-3
    assert len(board._samples) <= 1
    table.close()


def test_a_watchdog_that_expired_is_told_by_the_cycle_not_by_the_clock() -> None:
    board = MovingBoard(ManualClock())
    table = opened(board)
    run(table, 20)
    board.clock.advance(0.1)
    assert table.clock.wait_until(table.clock.now()) >= 0.0
    with pytest.raises(DriveStopped, match="watchdog"):
        table.exchange(200, 0.0)
    table.close()


def test_before_and_after_it_is_the_computer_s_clock() -> None:
    board = MovingBoard(ManualClock(5.0))
    table = opened(board)
    assert table.clock.now() == 5.0
    assert table.clock.wait_until(5.5) == 0.0
    assert table.clock.now() == 5.5
    run(table, 10)
    table.quick_stop()
    now = table.clock.now()
    board.clock.advance(0.25)
    assert table.clock.now() == pytest.approx(now + 0.25)
    table.close()


def test_paced_by_another_clock_old_samples_are_found_and_skipped() -> None:
    """A caller that sleeps by the computer's clock while the board is 1000 ppm quicker."""
    board = MovingBoard(ManualClock(), drift=-1e-3)
    table = opened(board)
    begin = board.clock.now()
    piled = []
    for k in range(8000):
        board.clock.wait_until(begin + k * H)
        table.exchange(k, 0.0)
        piled.append(len(board._samples))
    assert max(piled) <= 2
    table.close()


def test_no_time_is_lost_between_two_runs() -> None:
    board = MovingBoard(ManualClock())
    table = opened(board)
    for _ in range(3):
        done, lateness = run(table, 1001)
        assert done == list(range(1001))
        assert max(lateness) < 0.01 * H
        table.disable()
        assert not board.running
        table.enable(table.position)
    table.close()
    assert np.isfinite(table.position)
