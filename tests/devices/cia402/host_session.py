"""What our host does with a servo that is not ours: the same calls live and against a recording."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import pytest

from devices.cia402.master import Cia402Table
from devices.cia402.states import State
from devices.errors import DriveFault
from excitation import Capacity

if TYPE_CHECKING:
    from collections.abc import Callable

    from devices.clock import Clock
    from devices.sample import Sample

H = 1e-3
CAPACITY = Capacity(name="bench", stroke=0.2, velocity=0.5, acceleration=10.0, provenance={})
CYCLES, QUARTER = 120, 0.12
HEARTBEAT_OF_THE_HOST = 0x77F


def motion(cycle: int) -> float:
    """Where to be at the end of a cycle, m: a quarter of a sine, at full speed as it ends."""
    return 5e-3 * (1.0 - math.cos(0.5 * math.pi * (cycle + 1) * H / QUARTER))


def session(bus, clock: Clock, fail: Callable[[], None]) -> list[Sample]:
    """Open, enable, move, quick-stop, meet a fault, reset it, enable again and switch off; return the samples."""
    table = Cia402Table(bus, CAPACITY, clock=clock, time_limit=1.0, state_limit=10.0, stop_deceleration=1.0)
    with table:
        names = [description.name for description in table.describe()]
        assert names == ["Emulated servo drive"]
        table.enable(0.0)
        begin = clock.now()
        samples = []
        for cycle in range(CYCLES):
            clock.wait_until(begin + cycle * H)
            samples.append(table.exchange(cycle, motion(cycle)))
        table.quick_stop(samples.append)
        assert table.state is State.SWITCH_ON_DISABLED
        fail()
        with pytest.raises(DriveFault, match="reports error 7500"):
            table.enable(table.position)
        table.reset_fault()
        table.enable(table.position)
        table.exchange(0, table.position)
        table.disable()
        assert table.state is State.SWITCH_ON_DISABLED
    return samples
