"""The contract of `capacity_contract` where the host closes the loop: nothing beyond the capacity is pushed for."""

from __future__ import annotations

import math

import numpy as np
import pytest

from devices.clock import ManualClock
from devices.errors import SetpointRefused
from devices.quanser_st3.capacity import CAPACITY
from devices.quanser_st3.hil_driver import open_table
from devices.quanser_st3.hil_loop import HostLoop
from excitation import Motion
from tests.devices.capacity_contract import NEAR, SEEN, Case, Performed, cases, violations
from tests.devices.quanser_st3.quanser_board import MovingBoard, module

H = 1e-3
EVERY = list(cases(CAPACITY))
each = pytest.mark.parametrize("case", EVERY, ids=[f"{case.kind}-{case.limit}" for case in EVERY])


def perform(motion: Motion, monkeypatch: pytest.MonkeyPatch) -> tuple[Performed, MovingBoard]:
    """Perform a motion on a board that moves; what is pushed for is the middle of each cycle's set-points."""
    board = MovingBoard(ManualClock())
    pushed: list[float] = []
    voltage = HostLoop.voltage

    def kept(self: HostLoop, setpoint: float, position: float, velocity: float) -> float:
        pushed.append(setpoint)
        return voltage(self, setpoint, position, velocity)

    monkeypatch.setattr(HostLoop, "voltage", kept)
    refused = None
    wired: dict[str, object] = {"board": "q8_usb", "amperes_per_volt": 2.0}
    with open_table(wired, hardware=module(board), clock=board.clock) as table:
        table.enable(motion.displacement(0.0))
        targets = motion.displacement(np.arange(1, math.ceil(motion.duration / H) + 1) * H)
        try:
            for cycle, target in enumerate(targets.tolist()):
                table.exchange(cycle, target)
        except SetpointRefused as error:
            refused = error.limit
    return Performed(np.array(pushed), refused), board


@each
@pytest.mark.parametrize("share", [1.0 - NEAR, 1.0])
def test_at_a_limit_and_just_below(case: Case, share: float, monkeypatch: pytest.MonkeyPatch) -> None:
    done, board = perform(case.motion(case.pulse(share), case.capacity), monkeypatch)
    assert done.refused is None
    assert violations(done.setpoints, CAPACITY, step=H) == []
    # the loop overshoots by less than a millimetre
    assert abs(board.position) < 0.109
    assert board.output == 0.0


@each
def test_beyond_a_limit(case: Case, monkeypatch: pytest.MonkeyPatch) -> None:
    done, board = perform(case.motion(case.pulse(1.0 + SEEN), None), monkeypatch)
    assert done.refused in {case.limit, "braking" if case.limit == "stroke" else case.limit}
    assert violations(done.setpoints, CAPACITY, step=H) == []
    assert board.output == 0.0
