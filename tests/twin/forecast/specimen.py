"""A simulated specimen with its sensors, and an observer that follows it, sample by sample."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from excitation import Pulse
from twin.forecast.observer import Observer
from twin.rocking.block import Block
from twin.rocking.track import TrackedBlock

DT = 1e-3


@dataclass
class Seen:
    """One sample: time s; base acceleration m/s2, true; the true block and its observer."""

    time: float
    acceleration: float
    block: TrackedBlock
    observer: Observer


def follow(
    block: TrackedBlock,
    observer: Observer,
    seconds: float,
    pulse: Pulse | None = None,
    *,
    noise: float = 1e-3,
    step: float = 1e-4,
    acceleration_noise: float = 0.0,
    seed: int = 0,
    sensor: Callable[[float, float], float] = lambda _, reading: reading,
) -> Iterator[Seen]:
    """Let `block` go and the observer after it; `sensor` may change a reading (time s, rad)."""
    rng = np.random.default_rng(seed)
    before = 0.0
    for k in range(round(seconds / DT)):
        t = k * DT
        acceleration = 0.0 if pulse is None else float(pulse.acceleration(t))
        if k:
            block.advance(DT, before, acceleration)
        before = acceleration
        reading = block.rotation + noise * rng.standard_normal()
        reading = step * round(reading / step) if step else reading
        measured = acceleration + acceleration_noise * rng.standard_normal()
        observer.update(t, measured, sensor(t, reading))
        yield Seen(t, acceleration, block, observer)


def slenderer(block: Block, share: float) -> Block:
    """Return the block with its slenderness changed by a share, at the same diagonal."""
    alpha, diagonal = block.slenderness * (1.0 + share), 2.0 * block.half_diagonal
    return Block(diagonal * math.sin(alpha), diagonal * math.cos(alpha))
