"""The exact calls of Quanser's HIL API, in order; leftovers fail."""

from __future__ import annotations

import math
from typing import Any

import pytest

from devices.clock import ManualClock
from devices.errors import BusUnavailable
from devices.quanser_st3.hil_card import quanser_hardware
from devices.quanser_st3.hil_driver import open_table
from tests.devices.quanser_st3.quanser_board import ExpectedCalls, HILError, module

WIRED: dict[str, object] = {"board": "q8_usb", "amperes_per_volt": 2.0}
STEP = 12.7e-3 / 8192
OUT, IN, ENCODERS = ("uint32", [0]), ("uint32", [0]), ("uint32", [0, 1])


def fills(value: int) -> Any:
    """What `read_encoder` is given back; the buffer is zero before."""

    def fill(channels: Any, count: int, buffer: Any) -> None:
        buffer[0] = value

    return fill


def sample(before: list[int], encoder: int, rotation: int = 0) -> tuple[str, tuple[Any, ...], Any]:
    def fill(task: str, count: int, analog: Any, counts: Any, digital: None, other: None) -> int:
        counts[:] = encoder, rotation
        return 1

    return ("task_read", ("task", 1, ("float64", [0.0]), ("int32", before), None, None), fill)


def write(value: Any) -> tuple[str, tuple[Any, ...], Any]:
    return ("write_analog", (OUT, 1, ("float64", [value])), None)


def look(before: list[int], encoder: int) -> list[tuple[str, tuple[Any, ...], Any]]:
    return [
        ("read_encoder", (ENCODERS, 2, ("int32", before)), fills(encoder)),
        ("read_analog", (IN, 1, ("float64", [0.0])), None),
    ]


def life() -> list[tuple[str, tuple[Any, ...], Any]]:
    """Open at 0, two cycles, a stop, close."""
    # One cycle after 0 the encoder says 3 counts: w^2 and 2 zeta w by hand, 7.74 kg, Kt 0.360, 12.7 mm/rev, 2 A/V.
    w = math.tau * 31.9
    asked = w * w * -3 * STEP - 2 * 0.78 * w * 3 * STEP / 1e-3
    push = pytest.approx(7.74 * asked * 12.7e-3 / (math.tau * 0.360) / 2.0, rel=1e-12)
    back = pytest.approx(-7.74 * (asked + w * w * 3 * STEP) * 12.7e-3 / (math.tau * 0.360) / 2.0, rel=1e-12)
    calls: list[tuple[str, tuple[Any, ...], Any]] = [
        ("open", ("q8_usb", "0"), None),
        write(0.0),
        *look([0, 0], 0),
        # enable
        *look([0, 0], 0),
        ("watchdog_is_expired", (), False),
        # first exchange
        ("watchdog_set_analog_expiration_state", (OUT, 1, ("float64", [0.0])), None),
        ("task_create_reader", (100, IN, 1, ENCODERS, 2, None, 0, None, 0), "task"),
        ("task_start", ("task", 0, 1000.0, -1), None),
        sample([0, 0], 0),
        ("watchdog_start", (0.005,), None),
        write(0.0),
        # second
        sample([0, 0], 3, 100),
        ("watchdog_reload", (), True),
        write(push),
        # stop: the ramp is over at once, and the table has stood for ten cycles
        sample([3, 100], 0),
        ("watchdog_reload", (), True),
        write(back),
    ]
    for _ in range(9):
        calls += [sample([0, 0], 0), ("watchdog_reload", (), True), write(0.0)]
    calls += [
        write(0.0),
        ("watchdog_stop", (), None),
        ("task_stop", ("task",), None),
        ("task_delete", ("task",), None),
    ]
    for _ in range(10):
        calls += [write(0.0), *look([0, 0], 0)]
    return [*calls, write(0.0), ("close", (), None)]


def test_a_short_life() -> None:
    board = ExpectedCalls(life())
    with open_table(WIRED, hardware=module(board), clock=ManualClock()) as table:
        table.enable(0.0)
        first = table.exchange(0, 0.0)
        second = table.exchange(1, 0.0)
    assert not board.left
    assert (first.cycle, first.time, first.position, first.rotation) == (0, 0.0, 0.0, 0.0)
    assert second.position == pytest.approx(3 * STEP)
    assert second.rotation == pytest.approx(100 * math.tau / 40000)
    assert second.status & 0x6F == 0x27


def test_the_check_itself_finds_a_call_out_of_order() -> None:
    calls = life()
    calls[1], calls[2] = calls[2], calls[1]
    with pytest.raises(AssertionError):
        open_table(WIRED, hardware=module(ExpectedCalls(calls)), clock=ManualClock())


def test_channels_that_let_go_with_the_watchdog() -> None:
    """Quanser's Q8 boards reset their analog outputs only together with all digital ones."""
    calls = life()
    where = next(k for k, call in enumerate(calls) if call[0] == "task_create_reader")
    state = ("watchdog_set_digital_expiration_state", (("uint32", [0, 1]), 2, ("int32", [2, 2])), None)
    board = ExpectedCalls([*calls[:where], state, *calls[where:]])
    table = open_table({**WIRED, "tristate_channels": [0, 1]}, hardware=module(board), clock=ManualClock())
    with table:
        table.enable(0.0)
        table.exchange(0, 0.0)
        table.exchange(1, 0.0)
    assert not board.left


def test_a_board_whose_watchdog_needs_no_telling() -> None:
    calls = [call for call in life() if call[0] != "watchdog_set_analog_expiration_state"]
    board = ExpectedCalls(calls)
    with open_table({**WIRED, "built_in_zero": True}, hardware=module(board), clock=ManualClock()) as table:
        table.enable(0.0)
        table.exchange(0, 0.0)
        table.exchange(1, 0.0)
    assert not board.left


def test_describe_moves_nothing() -> None:
    calls = [*life()[:4], ("watchdog_is_expired", (), False), write(0.0), ("close", (), None)]
    board = ExpectedCalls(calls)
    with open_table(WIRED, hardware=module(board), clock=ManualClock()) as table:
        (told,) = table.describe()
    assert (told.name, told.software, told.state) == ("HIL board q8_usb 0", "HIL 4.1.3234", "output at 0 V")
    assert not board.left


def test_a_board_that_is_not_there_is_one_sentence() -> None:
    def refuses(*_: Any) -> None:
        raise HILError("no such board")

    board = ExpectedCalls([("open", ("q8_usb", "0"), refuses)])
    with pytest.raises(
        BusUnavailable, match=r"HIL board q8_usb 0 cannot be opened: It is not possible: no such board\."
    ):
        open_table(WIRED, hardware=module(board))


def test_software_that_is_not_there_is_one_sentence() -> None:
    with pytest.raises(BusUnavailable, match=r"^quanser.hardware is not installed here: .*, not from PyPI\)$"):
        open_table(WIRED)
    with pytest.raises(BusUnavailable):
        quanser_hardware()


@pytest.mark.parametrize(
    ("table", "words"),
    [
        ({}, "needs board and amperes_per_volt in the table .hil. of its capacity file"),
        ({"board": "q8_usb"}, "needs amperes_per_volt"),
        ({**WIRED, "amperes_per_volt": 0.0}, "hil has amperes_per_volt is 0; it must not be"),
        ({**WIRED, "encoder_channel": -1}, "hil has encoder_channel = -1"),
        ({**WIRED, "gain": 3}, "hil has an unknown key 'gain'"),
        ({**WIRED, "watchdog_ms": 0}, "hil has watchdog = 0"),
        ({**WIRED, "board": ""}, "hil has board = ''"),
    ],
)
def test_wiring_that_cannot_be_is_one_sentence(table: dict[str, object], words: str) -> None:
    with pytest.raises((BusUnavailable, ValueError), match=words) as error:
        open_table(table, hardware=module(ExpectedCalls([])))
    assert "\n" not in str(error.value)
