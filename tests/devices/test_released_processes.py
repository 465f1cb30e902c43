"""A released machine in a process of its own: the same frames over multicast, and what it does without its host."""

from __future__ import annotations

import multiprocessing
import runpy
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from devices.catalogue import find_device
from devices.cia301.buses import open_bus
from devices.clock import WallClock
from devices.positioning import bring_to
from excitation import ConstantPulse, DoublePulse, ReleasedRun
from tests.devices.test_two_processes import free_port, multicast_works

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from devices.released_table import ReleasedTable

H = 1e-3
# What the emulators are set for unless told.
PULSES = {"air_track": ConstantPulse(2.0, 0.1), "roori1": DoublePulse(0.2, 0.02)}
both = pytest.mark.parametrize("name", sorted(PULSES))


class Far:
    """The emulator's process."""

    def __init__(self, name: str, port: int) -> None:
        spawn = multiprocessing.get_context("spawn")
        self.stop, self.ready = spawn.Event(), spawn.Event()
        self.report, far_end = spawn.Pipe(duplex=False)
        handed: dict[str, Any] = {
            "stop": self.stop,
            "ready": self.ready,
            "report": far_end,
            "port": port,
            "name": name,
        }
        script = str(Path(__file__).with_name("released_process.py"))
        self.process = spawn.Process(target=runpy.run_path, args=(script, handed, "__released__"), daemon=True)
        self.process.start()
        far_end.close()

    def end(self) -> tuple[bool, bool, bool]:
        """Stop it; return whether it was armed, held and at rest in the end."""
        self.stop.set()
        assert self.report.poll(20.0)
        return self.report.recv()

    def close(self) -> None:
        self.stop.set()
        self.process.join(10.0)
        if self.process.is_alive():
            self.process.kill()
            self.process.join()
        self.process.close()
        self.report.close()


@pytest.fixture
def far() -> Iterator[Callable[[str], tuple[Far, int]]]:
    port = free_port()
    if not multicast_works(port):
        pytest.skip("UDP multicast does not reach its own machine here")
    made: list[Far] = []

    def start(name: str) -> tuple[Far, int]:
        process = Far(name, port)
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
