"""What every table that follows set-points inherits: no command beyond its capacity passes, whatever the excitation.

Every kind of excitation is made as long as it takes for one limit (stroke, velocity, acceleration) to be the one that
binds, and as large as a stated share of that limit; it is then performed by the device's own driver and emulator.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
import pytest
from scipy.optimize import brentq

from devices.catalogue import CatalogueEntry
from devices.cia301.buses import open_bus
from devices.clock import ManualClock
from devices.errors import SetpointRefused
from excitation import Capacity, ConstantPulse, CosineWave, DoublePulse, Motion, Pulse, Record, SineWave, clip
from excitation.demand import Terms

LIMITS = ("stroke", "velocity", "acceleration")
H = 2e-3
"""Cycle time of the runs, s: as long as a drive allows is quicker to test, and differences smooth a peak a little."""
NEAR = 1e-6
"""Just below and just above, as a share; clipping is exact to 1e-12."""
SEEN = 0.04
"""Above, as a share, for one who does not clip: what mean values over two cycles cannot hide."""
_channels = itertools.count()

Shape = Callable[[float, float], Pulse]
"""Length, s, and size, m/s2 -> pulse."""


def record(length: float, size: float) -> Pulse:
    return Record(size * np.array([0.0, 1.0, 1.0, 1.0, 0.0, -1.0, -1.0, -1.0, 0.0]), length / 8.0)


def double_pulse(length: float, size: float) -> Pulse:
    # Speeds up for a quarter of its length, coasts for half of it.
    velocity = 0.25 * size * length
    return DoublePulse(velocity, 0.625 * velocity * length, 0.0, size)


SHAPES: dict[str, Shape] = {
    "sine": lambda length, size: SineWave(size, 1.0 / length),
    "cosine": lambda length, size: CosineWave(size, 1.0 / length),
    "constant": lambda length, size: ConstantPulse(size, length),
    "double pulse": double_pulse,
    "record": record,
}


@dataclass(frozen=True)
class Case:
    """One kind of excitation, as long as it takes for one limit to bind."""

    kind: str
    limit: str
    length: float
    capacity: Capacity

    @property
    def brake(self) -> float:
        return 0.5 * self.capacity.acceleration

    def pulse(self, share: float) -> Pulse:
        """The pulse that uses `share` of the limit, to 12 digits."""

        def beyond(size: float) -> float:
            return self.terms.usage(SHAPES[self.kind](self.length, size))[self.limit] / share - 1.0

        most = 4.0 * self.capacity.acceleration
        size = brentq(beyond, 1e-6 * most, most, xtol=1e-15 * most, rtol=1e-14)
        return SHAPES[self.kind](self.length, size)

    @property
    def terms(self) -> Terms:
        return Terms(self.capacity, self.brake)

    def motion(self, pulse: Pulse, capacity: Capacity | None) -> Motion:
        return Motion(pulse, 0.5 * self.capacity.acceleration, capacity=capacity, brake=self.brake, settle=0.1)


def cases(capacity: Capacity) -> Iterator[Case]:
    """Every kind at every limit that can bind it; shorter pulses ask for acceleration, longer ones for stroke."""
    terms = Terms(capacity, 0.5 * capacity.acceleration)
    for kind, shape in SHAPES.items():
        waves = kind in ("sine", "cosine") and capacity.frequency is not None
        shortest = 1.0 / capacity.frequency * (1.0 + 1e-9) if waves else 0.03
        lengths = np.geomspace(shortest, 10.0, 60)
        usages = [terms.usage(shape(float(length), 1.0)) for length in lengths]
        for limit in LIMITS:
            leads = [usage[limit] / max(usage[other] for other in LIMITS if other != limit) for usage in usages]
            # As short as it binds clearly: a test need not take longer.
            clear = [length for length, lead in zip(lengths, leads, strict=True) if lead > 1.1]
            if clear:
                yield Case(kind, limit, float(min(clear)), capacity)


@dataclass
class Performed:
    """What reached the emulated machine, and the limit that ended it, if one did."""

    setpoints: np.ndarray
    refused: str | None


def perform(entry: CatalogueEntry, capacity: Capacity, motion: Motion) -> Performed:
    """Send a motion to the device's emulator through its own driver, cycle by cycle."""
    channel, clock = f"contract {next(_channels)}", ManualClock()
    with open_bus("virtual", channel) as host, open_bus("virtual", channel) as node:
        emulator = entry.emulator(
            node, rng=np.random.default_rng(1), capacity=capacity, cycle_time=H, clock=clock, initial_rotation=0.0
        )
        reached: list[float] = []
        advance = emulator.plant.advance
        emulator.plant.advance = lambda setpoint: (reached.append(setpoint), advance(setpoint))[1]
        table = entry.open_table(
            host, capacity=capacity, cycle_time=H, clock=clock, idle=emulator.service, rotation=False
        )
        refused = None
        with table:
            table.enable(motion.displacement(0.0))
            targets = motion.displacement(np.arange(1, math.ceil(motion.duration / H) + 1) * H)
            try:
                for cycle, target in enumerate(targets.tolist()):
                    table.exchange(cycle, target)
            except SetpointRefused as error:
                refused = error.limit
            table.quick_stop()
        return Performed(np.array(reached), refused)


def violations(setpoints: np.ndarray, capacity: Capacity, resolution: float = 1e-9, step: float = H) -> list[str]:
    """Say which limits were passed by what reached the machine; positions are rounded to `resolution`, m."""
    velocity = np.diff(setpoints) / step
    found = {
        "stroke": np.max(np.abs(setpoints)) - 0.5 * capacity.stroke - resolution,
        "velocity": np.max(np.abs(velocity)) - capacity.velocity - resolution / step,
        "acceleration": np.max(np.abs(np.diff(velocity))) / step - capacity.acceleration - 4.0 * resolution / step**2,
    }
    return [f"{name} by {over:.3g}" for name, over in found.items() if over > 0.0]


def check_within(entry: CatalogueEntry, case: Case, share: float) -> None:
    """At a limit and below it the whole motion is performed."""
    pulse = case.pulse(share)
    clipped = clip(pulse, case.capacity, brake=case.brake)
    assert clipped.given is pulse
    done = perform(entry, case.capacity, case.motion(pulse, case.capacity))
    assert done.refused is None
    assert violations(done.setpoints, case.capacity) == []
    # It was used: this is no test of a table that stands still.
    assert clipped.usage[case.limit] > 0.999


def check_just_above(case: Case) -> None:
    """What asks for a millionth too much is not planned as it is, and what is given in its place is within."""
    pulse = case.pulse(1.0 + NEAR)
    clipped = clip(pulse, case.capacity, brake=case.brake)
    assert clipped.changed
    assert clipped.limits[0].name == case.limit
    if clipped.given is not None:
        assert max(clipped.usage.values()) <= 1.0
    with pytest.raises(ValueError, match=f"of {case.limit}; "):
        case.motion(pulse, case.capacity)


def check_beyond(entry: CatalogueEntry, case: Case) -> None:
    """Who does not clip is refused by the table, and nothing beyond the capacity reaches the machine, stop included."""
    pulse = case.pulse(1.0 + SEEN)
    done = perform(entry, case.capacity, case.motion(pulse, None))
    # Before the end of the stroke there is no way left to stop.
    assert done.refused in {case.limit, "braking" if case.limit == "stroke" else case.limit}
    assert violations(done.setpoints, case.capacity) == []
