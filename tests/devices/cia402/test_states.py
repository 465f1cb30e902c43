"""The CiA 402 state machine, by its table."""

from __future__ import annotations

import pytest

from devices.cia402.states import (
    DISABLE_VOLTAGE,
    ENABLE_OPERATION,
    FAULT_RESET,
    QUICK_STOP,
    SHUTDOWN,
    SWITCH_ON,
    State,
    StateMachine,
    decode,
)

S = State


def machine_in(state: State) -> StateMachine:
    machine = StateMachine()
    machine.state = state
    return machine


@pytest.mark.parametrize(
    ("statusword", "state"),
    [
        (0x0000, S.NOT_READY),
        (0x0250, S.SWITCH_ON_DISABLED),
        (0x0231, S.READY_TO_SWITCH_ON),
        (0x0233, S.SWITCHED_ON),
        (0x0237, S.OPERATION_ENABLED),
        (0x1637, S.OPERATION_ENABLED),
        (0x0217, S.QUICK_STOP_ACTIVE),
        (0x021F, S.FAULT_REACTION_ACTIVE),
        (0x0218, S.FAULT),
        (0x0238, S.FAULT),
        (0x0001, None),
        (0x0063, None),
    ],
)
def test_decode(statusword: int, state: State | None) -> None:
    assert decode(statusword) is state


def test_no_word_is_two_states() -> None:
    for word in range(0x10000):
        assert sum(word & s.value[0] == s.value[1] for s in State) == (decode(word) is not None)


@pytest.mark.parametrize("state", list(State))
def test_every_state_tells_itself(state: State) -> None:
    assert decode(machine_in(state).statusword) is state


# rows: state; columns: what each command leads to. A dot stays.
COMMANDS = (DISABLE_VOLTAGE, QUICK_STOP, SHUTDOWN, SWITCH_ON, ENABLE_OPERATION, FAULT_RESET)
TABLE = {
    S.NOT_READY: (".", ".", ".", ".", ".", "."),
    S.SWITCH_ON_DISABLED: (".", ".", S.READY_TO_SWITCH_ON, ".", ".", "."),
    S.READY_TO_SWITCH_ON: (
        S.SWITCH_ON_DISABLED,
        S.SWITCH_ON_DISABLED,
        ".",
        S.SWITCHED_ON,
        S.OPERATION_ENABLED,
        ".",
    ),
    S.SWITCHED_ON: (
        S.SWITCH_ON_DISABLED,
        S.SWITCH_ON_DISABLED,
        S.READY_TO_SWITCH_ON,
        ".",
        S.OPERATION_ENABLED,
        ".",
    ),
    S.OPERATION_ENABLED: (
        S.SWITCH_ON_DISABLED,
        S.QUICK_STOP_ACTIVE,
        S.READY_TO_SWITCH_ON,
        S.SWITCHED_ON,
        ".",
        ".",
    ),
    S.QUICK_STOP_ACTIVE: (S.SWITCH_ON_DISABLED, ".", ".", ".", ".", "."),
    S.FAULT_REACTION_ACTIVE: (".", ".", ".", ".", ".", "."),
    S.FAULT: (".", ".", ".", ".", ".", S.SWITCH_ON_DISABLED),
}


@pytest.mark.parametrize("before", list(State))
@pytest.mark.parametrize("column", range(len(COMMANDS)))
def test_transitions(before: State, column: int) -> None:
    machine = machine_in(before)
    machine.command(COMMANDS[column], standstill=True)
    expected = TABLE[before][column]
    assert machine.state is (before if expected == "." else expected)


def test_the_way_up_is_open_only_at_standstill() -> None:
    machine = machine_in(S.SWITCH_ON_DISABLED)
    machine.command(SHUTDOWN, standstill=False)
    assert machine.state is S.SWITCH_ON_DISABLED
    machine = machine_in(S.SWITCHED_ON)
    machine.command(ENABLE_OPERATION, standstill=False)
    assert machine.state is S.SWITCHED_ON


def test_a_fault_is_reset_by_the_rising_edge_alone() -> None:
    machine = machine_in(S.OPERATION_ENABLED)
    machine.command(FAULT_RESET, standstill=True)
    machine.fault()
    assert machine.state is S.FAULT_REACTION_ACTIVE
    machine.stopped()
    assert machine.state is S.FAULT
    machine.command(FAULT_RESET, standstill=True)
    assert machine.state is S.FAULT  # the bit was up already
    machine.command(0, standstill=True)
    machine.command(FAULT_RESET, standstill=True)
    assert machine.state is S.SWITCH_ON_DISABLED


def test_self_test_and_ends_of_ramps() -> None:
    machine = StateMachine()
    assert machine.state is S.NOT_READY
    machine.ready()
    assert machine.state is S.SWITCH_ON_DISABLED
    machine.stopped()
    assert machine.state is S.SWITCH_ON_DISABLED
    machine = machine_in(S.QUICK_STOP_ACTIVE)
    machine.stopped()
    assert machine.state is S.SWITCH_ON_DISABLED
    machine.ready()
    machine = machine_in(S.FAULT)
    machine.fault()
    assert machine.state is S.FAULT
