"""What every emulated machine has from its base: nodes on a bus, a watchdog, a specimen that is let go in time."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import pytest

from devices.cia301.buses import CanBus, open_bus
from devices.clock import ManualClock
from devices.emulation import Emulation
from devices.quanser_st3.driver import open_table
from devices.quanser_st3.emulator import EmulatedSt3
from tests.devices.cia301.example import Example

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

H = 1e-3


class Stand:
    """Something with a specimen on it."""

    def __init__(self) -> None:
        self.released = True
        self.rotation = 0.0


class Machine(Emulation):
    """Two example nodes; powered, and moving, as it is told."""

    def __init__(self, bus: CanBus, clock: ManualClock, set_up: Callable[[], None] | None = None) -> None:
        super().__init__(bus, cycle_time=H, clock=clock, set_up=set_up, initial_rotation=0.1)
        self.on = self.moves = False
        self.lived: list[int] = []
        self.stand = Stand()
        self.first, self.second = Example(5), Example(6)
        for device in (self.first, self.second):
            device.node.send = self.send
        self.attach(self.stand, [self.first, self.second])

    @property
    def powered(self) -> bool:
        return self.on

    @property
    def at_ease(self) -> bool:
        return not self.moves

    def patience(self, idle_cycles: int) -> int:
        return min(20, idle_cycles)

    def elapse(self, cycles: int) -> None:
        self.lived.append(cycles)
        if sum(self.lived) > 300:
            self.moves = False


class Looks:
    """A stop signal that lets a millisecond pass at each look."""

    def __init__(self, clock: ManualClock, looks: int, each: Callable[[int], None] = lambda _: None) -> None:
        self.clock, self.looks, self.each, self.seen = clock, looks, each, 0

    def is_set(self) -> bool:
        self.clock.advance(H)
        self.each(self.seen)
        self.seen += 1
        return self.seen > self.looks


@pytest.fixture
def rig(request) -> Iterator[tuple[Machine, CanBus, ManualClock]]:
    clock = ManualClock()
    with open_bus("virtual", request.node.name) as near, open_bus("virtual", request.node.name) as far:
        yield Machine(far, clock), near, clock


def heard(bus: CanBus) -> list[tuple[int, bytes]]:
    return list(iter(bus.receive, None))


def test_it_boots_once_and_answers_what_waits(rig) -> None:
    machine, bus, _ = rig
    machine.service()
    machine.service()
    assert [frame for frame in heard(bus) if frame[1] == b"\0"] == [(0x705, b"\0"), (0x706, b"\0")]
    bus.send(0x000, b"\x01\x00")
    bus.send(0x080, b"\x01")
    machine.service()
    assert [identifier for identifier, _ in heard(bus) if identifier < 0x700] == [0x185, 0x186]


def test_the_specimen_is_held_until_the_power_comes_and_set_up_each_time(rig) -> None:
    _, _, clock = rig
    set_up: list[float] = []
    with open_bus("virtual", "stand") as near, open_bus("virtual", "stand") as far:
        machine = Machine(far, clock, lambda: set_up.append(machine.stand.rotation))
        assert not machine.stand.released
        for power, rotation in ((True, 0.0), (True, 0.3), (False, 0.3), (True, 0.4)):
            machine.on, machine.stand.rotation = power, rotation
            near.send(0x080, b"\x01")
            machine.service()
        assert machine.stand.released
        assert set_up == [0.0, 0.4]
        assert machine.stand.rotation == 0.1


def test_a_full_bus_is_no_end(rig) -> None:
    _, _, clock = rig
    with open_bus("virtual", "full rig", rx_queue_size=3), open_bus("virtual", "full rig") as far:
        machine = Machine(far, clock)
        for _ in range(4):
            clock.advance(1.0)
            machine.service()
        assert machine.unsent > 0


def test_without_sync_it_lives_by_its_own_clock_after_its_patience(rig) -> None:
    machine, _, clock = rig
    machine.moves = True
    machine.serve(Looks(clock, 100))
    # nothing for twenty cycles, then all of them at once, then one a cycle
    assert machine.lived[0] == pytest.approx(21, abs=1)
    assert set(machine.lived[1:]) == {1}
    assert sum(machine.lived) > 300
    assert machine.at_ease


def test_with_sync_it_does_not(rig) -> None:
    machine, bus, clock = rig
    machine.moves = True

    def ends(look: int) -> None:
        bus.send(0x080, bytes([look % 240 + 1]))
        machine.moves = look < 99

    machine.serve(Looks(clock, 100, ends))
    assert machine.lived == []


def test_the_host_sets_the_cycle_of_the_emulated_table() -> None:
    clock = ManualClock()
    with open_bus("virtual", "paced") as near, open_bus("virtual", "paced") as far:
        emulator = EmulatedSt3(far, rng=np.random.default_rng(1), clock=clock)
        with open_table(near, clock=clock, idle=emulator.service, rotation=False, cycle_time=4e-3) as table:
            assert emulator.cycle_time == pytest.approx(4e-3)
            table.enable(0.0)
            samples = [table.exchange(k, 0.01 * (1.0 - math.cos(math.tau * k * 4e-3))) for k in range(125)]
            table.disable()
    # the loop's lag is one of time: 2 zeta / w and the transport delay, at 0.063 m/s on the way
    lag = 0.01 * (1.0 - math.cos(math.tau * 61 * 4e-3)) - samples[62].position
    assert lag == pytest.approx(0.0628 * 8.8e-3, rel=0.1)


def test_one_that_is_at_ease_is_left_alone(rig) -> None:
    machine, bus, clock = rig
    machine.serve(Looks(clock, 500))
    assert machine.lived == []
    assert [identifier for identifier, _ in heard(bus)].count(0x705) == pytest.approx(3, abs=1)
