"""The ST-III over the HIL API on a board whose motor really moves: it follows, it stops, and every way out is 0 V."""

from __future__ import annotations

import math
import threading
from contextlib import suppress
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from devices.clock import ManualClock
from devices.errors import (
    BusFailure,
    DeviceError,
    DeviceTimeout,
    DriveFault,
    DriveStopped,
    LoopUnstable,
    SetpointRefused,
)
from devices.quanser_st3.hil_driver import open_table
from devices.quanser_st3.hil_table import HilTable
from devices.quanser_st3.parameters import St3Parameters
from devices.sample import Sample
from tests.devices.quanser_st3.quanser_board import HILError, MovingBoard, module

H = 1e-3
WIRED: dict[str, object] = {"board": "q8_usb", "amperes_per_volt": 2.0}


def table_on(board: MovingBoard, **arguments: Any) -> HilTable:
    return open_table(WIRED, hardware=module(board), clock=board.clock, **arguments)


def swing(frequency: float, size: float, cycles: int) -> np.ndarray:
    """Set-points at the ends of the cycles: starts at rest, reaches the full amplitude within a period."""
    t = H * np.arange(1, cycles + 1)
    return size * np.minimum(t * frequency, 1.0) ** 3 * np.sin(math.tau * frequency * t)


def follow(table: HilTable, positions: np.ndarray, first: int = 0) -> list[Sample]:
    return [table.exchange(first + k, float(x)) for k, x in enumerate(positions)]


CRUISE = H * np.cumsum(np.minimum(H * np.arange(1, 301) * 3.0, 0.3))
"""Set-points: speeding up to 0.3 m/s, and on."""


def moving(board: MovingBoard, **arguments: Any) -> HilTable:
    """Return an open table at 0.3 m/s, after 200 cycles."""
    table = table_on(board, **arguments)
    table.enable(0.0)
    follow(table, CRUISE[:200])
    assert board.velocity == pytest.approx(0.3, abs=0.02)
    return table


@pytest.mark.parametrize("frequency", [1.0, 4.0])
@pytest.mark.parametrize("payload", [0.0, 2.5692])
def test_a_sine_is_followed_as_the_loop_does(frequency: float, payload: float) -> None:
    board = MovingBoard(ManualClock(), friction=0.0, payload=payload)
    size, cycles = 0.01 / frequency, round(4 / frequency / H)
    with table_on(board) as table:
        table.enable(0.0)
        samples = follow(table, swing(frequency, size, cycles))
        steady = samples[cycles // 2 :]
        t = np.array([s.time for s in steady])
        found = 2j * np.mean([s.position for s in steady] * np.exp(-1j * math.tau * frequency * t)) / size
    # Without the emulator's delay. The position is held over a cycle, h / 2 old in the mean, which takes w^2 h / 2 off
    # the damping: the lag 2 zeta / w becomes less by h / 2.
    theory = replace(St3Parameters().loop(payload), transport_delay=-0.5 * H).response(frequency)
    assert abs(found - theory) < 3e-3
    assert [s.cycle for s in samples] == list(range(cycles))


def test_the_acceleration_is_the_accelerometer_s() -> None:
    board = MovingBoard(ManualClock(), friction=0.0)
    with table_on(board) as table:
        table.enable(0.0)
        for k, x in enumerate(swing(4.0, 0.003, 300)):
            before = board.acceleration
            assert table.exchange(k, float(x)).acceleration == pytest.approx(before, abs=2.0)


def test_a_stop_brakes_with_the_scene_s_deceleration_and_ends_at_0_v() -> None:
    board = MovingBoard(ManualClock(), friction=0.0)
    table = moving(board, stop_deceleration=1.09)
    way: list[Sample] = []
    begin = board.position
    table.quick_stop(way.append)
    assert board.position - begin == pytest.approx(0.3**2 / 2 / 1.09, abs=4e-3)
    assert [s.cycle for s in way] == list(range(200, 200 + len(way)))
    assert len(way) * H == pytest.approx(0.3 / 1.09, abs=0.06)
    assert (board.output, board.running, board.velocity) == (0.0, False, pytest.approx(0.0, abs=1e-3))
    assert not table.powered
    table.close()
    assert board.closed


def test_a_stop_near_the_end_of_the_stroke_is_as_steep_as_it_must_be() -> None:
    board = MovingBoard(ManualClock(), friction=0.0)
    table = table_on(board, stop_deceleration=0.5)
    table.enable(0.0)
    v, x, targets = 0.0, 0.0, []
    while x < 0.09:
        v = min(0.4, v + 4.0 * H)
        x += v * H
        targets.append(x)
    follow(table, np.array(targets))
    way: list[Sample] = []
    table.quick_stop(way.append)
    assert max(s.position for s in way) < 0.108 + 1e-3
    assert board.output == 0.0


def test_set_points_beyond_the_capacity_never_reach_the_board() -> None:
    board = MovingBoard(ManualClock())
    with table_on(board) as table:
        with pytest.raises(SetpointRefused, match="from the centre"):
            table.enable(0.2)
        with pytest.raises(SetpointRefused, match="it stands at"):
            table.enable(0.01)
        table.enable(0.0)
        table.exchange(0, 0.0)
        calls = len(board.calls)
        for beyond in (0.12, 1e-3, math.nan):
            with pytest.raises(ValueError, match="quanser_st3"):
                table.exchange(1, beyond)
        assert len(board.calls) == calls
    assert board.largest == 0.0


def test_a_host_that_stalls_finds_0_v() -> None:
    board = MovingBoard(ManualClock())
    table = moving(board)
    board.clock.advance(4.5e-3)
    table.exchange(204, CRUISE[204])
    assert board.output != 0.0
    stalled = board.clock.now()
    board.clock.advance(50e-3)
    board.live(stalled + 4.9e-3)
    assert board.output != 0.0
    board.live(stalled + 5.0e-3 + 1e-9)
    assert board.output == 0.0
    with pytest.raises(
        DriveStopped, match="the watchdog of HIL board q8_usb 0 expired: the host was more than 5 ms late"
    ):
        table.exchange(255, CRUISE[255])
    way: list[Sample] = []
    table.quick_stop(way.append)
    # it coasts against its friction
    assert way[0].cycle == 256
    assert board.velocity == 0.0
    assert board.output == 0.0
    assert set(board.calls[-30:]) <= {"write_analog", "read_encoder", "read_analog"}
    with pytest.raises(DriveFault, match="acknowledge it with reset_fault"):
        table.enable(table.position)
    table.reset_fault()
    table.enable(table.position)
    table.close()


def test_a_host_that_dies_leaves_a_board_at_0_v_in_five_milliseconds() -> None:
    board = MovingBoard(ManualClock())
    moving(board)
    gone = board.clock.now()
    assert board.output != 0.0 or board.velocity > 0.2
    board.live(gone + 5.1e-3)
    assert board.output == 0.0
    board.live(gone + 1.0)
    assert board.velocity == 0.0


def scenario(board: MovingBoard) -> None:
    """Open, enable, move, stop, enable again, close."""
    with table_on(board, state_limit=0.6) as table:
        table.enable(0.0)
        follow(table, np.cumsum(np.minimum(H * np.arange(1, 41) * 4.0, 0.1)) * H)
        table.quick_stop()
        table.enable(table.position)
        table.exchange(100, table.position)


def counted() -> int:
    board = MovingBoard(ManualClock())
    scenario(board)
    return len(board.calls)


@pytest.mark.parametrize(
    "error", [HILError("x"), KeyboardInterrupt(), RuntimeError("not ours")], ids=lambda e: type(e).__name__
)
def test_whatever_fails_wherever_the_board_is_left_at_0_v(error: BaseException) -> None:
    """Every single call of a run fails once; the board ends at 0 V, closed, with nothing moving."""
    total = counted()
    assert total > 300
    # Quanser's own error in every call, others here and there.
    for number in range(0, total, 1 if isinstance(error, HILError) else 7):
        board = MovingBoard(ManualClock())
        board.fail_at = {number: error}
        with suppress(DeviceError, KeyboardInterrupt, RuntimeError):
            scenario(board)
        name = board.calls[number]
        board.live(board.clock.now() + 5.1e-3)
        assert board.output == 0.0, (number, name)
        assert board.closed or name in ("open", "close"), (number, name)
        board.live(board.clock.now() + 1.0)
        assert board.velocity == 0.0, (number, name)


def test_an_output_that_cannot_be_written_is_said_loudly_and_left_to_the_watchdog() -> None:
    board = MovingBoard(ManualClock())
    table = moving(board, state_limit=0.5)
    assert table.powered
    board.fail_always = {"write_analog"}
    with pytest.raises(BusFailure, match="did not write its output"):
        table.exchange(200, CRUISE[200])
    with pytest.raises(DeviceTimeout, match="THE TABLE MAY STILL BE MOVING"):
        table.quick_stop()
    assert "watchdog_stop" not in board.calls
    assert table.powered
    with pytest.raises(DeviceTimeout):
        table.close()
    assert board.expired
    assert board.output == 0.0
    assert board.closed


def test_a_board_that_cannot_promise_0_v_is_not_used() -> None:
    board = MovingBoard(ManualClock())
    board.fail_always = {"watchdog_set_analog_expiration_state"}
    with table_on(board) as table:
        table.enable(0.0)
        with pytest.raises(BusFailure, match="did not take 0 V for an expired watchdog"):
            table.exchange(0, 0.0)
    assert board.largest == 0.0
    assert "task_start" not in board.calls


def test_a_read_that_never_returns_is_ended() -> None:
    board = MovingBoard(ManualClock())
    table = moving(board)
    stopped = threading.Event()

    def wait() -> int:
        assert stopped.wait(10.0)
        return 0

    def stop(task: str) -> None:
        board.calls.append("task_stop")
        stopped.set()

    board.blocked = wait
    board.task_stop = stop  # type: ignore[method-assign]
    with pytest.raises(DriveStopped, match="stopped sampling by itself"):
        table.exchange(200, CRUISE[200])
    assert board.output == 0.0
    table.close()


def test_an_encoder_that_says_nothing_ends_at_0_v_and_is_not_driven_on() -> None:
    board = MovingBoard(ManualClock())
    table = table_on(board, following_error=5e-3)
    table.enable(0.0)
    board.frozen = True
    with pytest.raises(DriveFault, match=r"is 5\.\d\d mm from its set-point; the limit is 5 mm") as error:
        follow(table, np.cumsum(np.minimum(H * np.arange(1, 401) * 3.0, 0.2)) * H)
    assert error.value.code == 0x8611
    assert board.output == 0.0
    writes = board.calls.count("write_analog")
    table.quick_stop()
    assert board.output == 0.0
    assert board.calls.count("write_analog") > writes
    table.close()


def test_a_table_that_is_pushed_out_of_its_stroke_is_let_go() -> None:
    board = MovingBoard(ManualClock())
    table = table_on(board, following_error=1.0)
    table.enable(0.0)
    table.exchange(0, 0.0)
    board.position = 0.1111
    with pytest.raises(DriveFault, match=r"is at 111\.\d\d mm; its stroke ends at 108 mm"):
        follow(table, np.zeros(3), 1)
    assert board.output == 0.0
    table.close()


def test_the_output_never_exceeds_the_motor_s_current() -> None:
    board = MovingBoard(ManualClock(), payload=100.0)
    wired = {**WIRED, "peak_current_a": 3.0}
    with open_table(wired, hardware=module(board), clock=board.clock, following_error=0.1) as table:
        table.enable(0.0)
        follow(table, np.cumsum(np.minimum(H * np.arange(1, 101) * 8.0, 0.4)) * H)
        assert board.largest == pytest.approx(1.5)


@pytest.mark.parametrize("rate", [250.0, 500.0])
def test_a_rate_at_which_the_loop_is_not_stable_is_refused(rate: float) -> None:
    board = MovingBoard(ManualClock())
    with pytest.raises(LoopUnstable, match=f"is not stable at {rate:g} cycles a second"):
        table_on(board, cycle_time=1.0 / rate)
    assert board.calls == []


def test_without_a_sensor_the_rotation_is_not_a_number() -> None:
    board = MovingBoard(ManualClock())
    board.rotation_count = 5000
    for rotation, expected in ((True, math.pi / 4), (False, math.nan)):
        with table_on(board, rotation=rotation) as table:
            table.enable(table.position)
            assert table.exchange(0, table.position).rotation == pytest.approx(expected, nan_ok=True)
