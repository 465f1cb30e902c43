"""A released machine in a process of its own: the same frames over multicast, and what it does without its host."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from devices.catalogue import find_device
from devices.cia301.buses import open_bus
from devices.clock import WallClock
from devices.positioning import bring_to
from excitation import ConstantPulse, DoublePulse, ReleasedRun
from tests.devices.far_process import FarProcess, free_port, multicast_works

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from devices.released_table import ReleasedTable

H = 1e-3
# What the emulators are set for unless told.
PULSES = {"air_track": ConstantPulse(2.0, 0.1), "roori1": DoublePulse(0.2, 0.02)}
both = pytest.mark.parametrize("name", sorted(PULSES))


@pytest.fixture
def far() -> Iterator[Callable[[str], tuple[FarProcess, int]]]:
    port = free_port()
    if not multicast_works(port):
        pytest.skip("UDP multicast does not reach its own machine here")
    made: list[FarProcess] = []

    def start(name: str) -> tuple[FarProcess, int]:
        process = FarProcess("released_process.py", "__released__", port=port, name=name)
        made.append(process)
        assert process.ready.wait(30.0)
        return process, port

    yield start
    for process in made:
        process.close()


def perform(table: ReleasedTable, run: ReleasedRun, until: float) -> list[float]:
    """The planned cycles in real time, late ones left out; return where the base was."""
    clock = WallClock()
    table.enable(0.0)
    begin, cycle, positions = clock.now(), 0, []
    while cycle * H < until:
        cycle = max(cycle, int((clock.now() - begin) / H))
        clock.wait_until(begin + cycle * H)
        positions.append(table.exchange(cycle, run.displacement((cycle + 1) * H)).position)
        cycle += 1
    return positions


def run_of(name: str) -> ReleasedRun:
    capacity = find_device(name).capacity
    assert capacity.machine is not None
    settings = capacity.machine.settings_for(PULSES[name], capacity, payload=2.5, coast=0.0)
    return ReleasedRun(capacity.machine, settings.pulse, wait=0.05, rest=0.1)


@both
def test_two_runs_one_after_the_other(far, name: str) -> None:
    process, port = far(name)
    run = run_of(name)
    for _ in range(2):
        with (
            open_bus("udp_multicast", port=port) as bus,
            find_device(name).open_table(bus, time_limit=0.5, rotation=False) as table,
        ):
            assert bring_to(table, 0.0, 1.0, WallClock())
            positions = perform(table, run, run.duration)
            assert positions[0] == 0.0
            # 2 ms of the latch, and a test machine that may have been late with the release.
            assert positions[-1] == pytest.approx(run.net_displacement, rel=0.02)
            table.disable()
    assert process.end() == (False, False, True)


@both
@pytest.mark.parametrize("released", [False, True])
def test_a_host_that_falls_silent(far, name: str, released: bool) -> None:
    process, port = far(name)
    run = run_of(name)
    with open_bus("udp_multicast", port=port) as bus:
        table = find_device(name).open_table(bus, time_limit=0.5, rotation=False)
        perform(table, run, 0.06 if released else 0.03)
        # No stop, no close: it is just gone.
    assert process.end() == (False, not released, True)
