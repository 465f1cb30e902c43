"""The CiA 402 state machine: controlword in, statusword out (IEC 61800-7-201).

::

    NOT_READY -> SWITCH_ON_DISABLED <-> READY_TO_SWITCH_ON <-> SWITCHED_ON <-> OPERATION_ENABLED
                   ^          ^                                                  |
                   |          +---- at standstill --- QUICK_STOP_ACTIVE <--------+
                   +-- reset (rising edge of bit 7) -- FAULT <-- at standstill -- FAULT_REACTION_ACTIVE <-- any
"""

from __future__ import annotations

from enum import Enum

SHUTDOWN, SWITCH_ON, ENABLE_OPERATION = 0x0006, 0x0007, 0x000F
DISABLE_VOLTAGE, QUICK_STOP, FAULT_RESET = 0x0000, 0x0002, 0x0080
"""Controlwords (object 6040)."""

VOLTAGE_ENABLED, REMOTE, INTERNAL_LIMIT = 1 << 4, 1 << 9, 1 << 11
"""Statusword flags (object 6041) beside the state's own bits."""
FOLLOWS_COMMAND, FOLLOWING_ERROR = 1 << 12, 1 << 13
"""Statusword flags of cyclic synchronous position mode."""
TARGET_REACHED, HOMING_ATTAINED, HOMING_ERROR = 1 << 10, 1 << 12, 1 << 13
"""Statusword flags of homing mode; the first is set while nothing moves."""
HOMING_START, HALT = 1 << 4, 1 << 8
"""Controlword flags of homing mode."""

CYCLIC_SYNCHRONOUS_POSITION, HOMING = 8, 6
"""Modes of operation (objects 6060 and 6061)."""
MODES = {8: "cyclic synchronous position", 6: "homing", 0: "no mode", 1: "profile position", 7: "interpolated position"}
"""Names of modes; others are the maker's."""


class State(Enum):
    """States of a CiA 402 drive; each value is (mask, pattern) of the statusword."""

    NOT_READY = (0x4F, 0x00)
    SWITCH_ON_DISABLED = (0x4F, 0x40)
    READY_TO_SWITCH_ON = (0x6F, 0x21)
    SWITCHED_ON = (0x6F, 0x23)
    OPERATION_ENABLED = (0x6F, 0x27)
    QUICK_STOP_ACTIVE = (0x6F, 0x07)
    FAULT_REACTION_ACTIVE = (0x4F, 0x0F)
    FAULT = (0x4F, 0x08)

    def __str__(self) -> str:
        return self.name.lower().replace("_", " ")


_STATE_OF: dict[int, State] = {
    word: state for word in range(0x80) for state in State if word & state.value[0] == state.value[1]
}


def decode(statusword: int) -> State | None:
    """Return the state a statusword tells; None where its bits are none of CiA 402's patterns.

    >>> decode(0x1637)
    <State.OPERATION_ENABLED: (111, 39)>
    """
    return _STATE_OF.get(statusword & 0x6F)


_WAY_UP: dict[State, int] = {
    State.NOT_READY: SHUTDOWN,
    State.SWITCH_ON_DISABLED: SHUTDOWN,
    State.READY_TO_SWITCH_ON: SWITCH_ON,
    State.SWITCHED_ON: ENABLE_OPERATION,
    State.QUICK_STOP_ACTIVE: QUICK_STOP,
}


def next_controlword(state: State | None) -> int:
    """Return the controlword that leads from a state towards OPERATION_ENABLED; DISABLE_VOLTAGE where none does.

    >>> hex(next_controlword(State.READY_TO_SWITCH_ON))
    '0x7'
    """
    return DISABLE_VOLTAGE if state is None else _WAY_UP.get(state, DISABLE_VOLTAGE)


class StateMachine:
    """A drive's state and its transitions.

    Attributes
    ----------
    stays : bool
        Whether a quick stop ends in QUICK_STOP_ACTIVE, with power, from where operation can be enabled again
        (605A = 5 and 6); else it ends in SWITCH_ON_DISABLED (605A = 1 and 2).
    """

    def __init__(self) -> None:
        self.state = State.NOT_READY
        self.stays = False
        self._reset_bit = False

    @property
    def statusword(self) -> int:
        """The state's bits and the flags that follow from it."""
        word = self.state.value[1] | REMOTE
        if self.state in (State.OPERATION_ENABLED, State.QUICK_STOP_ACTIVE, State.SWITCHED_ON):
            word |= VOLTAGE_ENABLED
        return word

    def ready(self) -> None:
        """The drive's self-test is over (transition 1)."""
        if self.state is State.NOT_READY:
            self.state = State.SWITCH_ON_DISABLED

    def command(self, controlword: int, *, standstill: bool) -> None:
        """Obey a controlword; the way up is open only at `standstill`."""
        reset_bit = bool(controlword & FAULT_RESET)
        rising = reset_bit and not self._reset_bit
        self._reset_bit = reset_bit
        if self.state is State.FAULT:
            if rising:
                self.state = State.SWITCH_ON_DISABLED
            return
        if self.state in (State.NOT_READY, State.FAULT_REACTION_ACTIVE) or reset_bit:
            return
        below = State.READY_TO_SWITCH_ON, State.SWITCHED_ON
        if not controlword & 0b0010:
            self.state = State.SWITCH_ON_DISABLED
        elif not controlword & 0b0100:
            if self.state is State.OPERATION_ENABLED:
                self.state = State.QUICK_STOP_ACTIVE
            elif self.state in below:
                self.state = State.SWITCH_ON_DISABLED
        elif self.state is State.QUICK_STOP_ACTIVE:
            if self.stays and standstill and controlword & 0b1001 == 0b1001:
                self.state = State.OPERATION_ENABLED
        elif not controlword & 0b0001:
            if self.state is not State.SWITCH_ON_DISABLED or standstill:
                self.state = State.READY_TO_SWITCH_ON
        elif not controlword & 0b1000:
            if self.state is State.OPERATION_ENABLED or self.state is State.READY_TO_SWITCH_ON:
                self.state = State.SWITCHED_ON
        elif self.state in below and standstill:
            self.state = State.OPERATION_ENABLED

    def fault(self) -> None:
        """Something is wrong: the fault reaction begins, unless it has."""
        if self.state is not State.FAULT:
            self.state = State.FAULT_REACTION_ACTIVE

    def quick_stop(self) -> None:
        """The drive itself begins a quick stop."""
        if self.state is State.OPERATION_ENABLED:
            self.state = State.QUICK_STOP_ACTIVE

    def stopped(self) -> None:
        """The ramp of a quick stop or of a fault reaction ended at standstill (transitions 12 and 14)."""
        if self.state is State.QUICK_STOP_ACTIVE and not self.stays:
            self.state = State.SWITCH_ON_DISABLED
        elif self.state is State.FAULT_REACTION_ACTIVE:
            self.state = State.FAULT
