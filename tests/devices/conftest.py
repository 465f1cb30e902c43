"""A whole table in one thread: host, two ends of a virtual bus, emulator, manual clock."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from devices.cia301.buses import CanBus, open_bus
from devices.clock import ManualClock
from devices.quanser_st3.driver import open_table
from devices.quanser_st3.emulator import EmulatedSt3

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from devices.cia402.master import Cia402Table

_channels = itertools.count()


@dataclass
class Rig:
    """Both ends, and a third tap to inject frames and to listen."""

    table: Cia402Table
    emulator: EmulatedSt3
    clock: ManualClock
    host: CanBus
    tap: CanBus

    def heard(self) -> list[tuple[int, bytes]]:
        """Every frame since the last call."""
        return list(iter(self.tap.receive, None))

    def follow(self, positions: list[float], first: int = 0) -> list[Any]:
        """One cycle for each position."""
        return [self.table.exchange(first + k, x) for k, x in enumerate(positions)]


@pytest.fixture
def make_rig() -> Iterator[Callable[..., Rig]]:
    """Factory of rigs; arguments go to the emulator. Buses are closed at the end."""
    buses: list[CanBus] = []

    def make(*, seed: int = 1, idle: bool = True, **arguments: Any) -> Rig:
        channel = f"rig {next(_channels)}"
        host, node, tap = (open_bus("virtual", channel) for _ in range(3))
        buses.extend((host, node, tap))
        clock = ManualClock()
        arguments.setdefault("specimen", lambda *_: 0.0)
        emulator = EmulatedSt3(node, rng=np.random.default_rng(seed), clock=clock, **arguments)
        table = open_table(
            host,
            clock=clock,
            idle=emulator.service if idle else None,
            rotation=arguments["specimen"] is not None,
            **{k: arguments[k] for k in ("capacity", "cycle_time") if k in arguments},
        )
        return Rig(table, emulator, clock, host, tap)

    yield make
    for bus in buses:
        bus.close()


@pytest.fixture
def rig(make_rig: Callable[..., Rig]) -> Rig:
    """An open table at 0, not enabled."""
    return make_rig()
