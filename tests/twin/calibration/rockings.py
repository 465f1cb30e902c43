"""Free-rocking recordings of known truth, flight by flight from `simulate`."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from twin.rocking.block import Block
from twin.simulation import simulate


class Rocking(NamedTuple):
    """A recording and the times of its impacts."""

    time: np.ndarray
    rotation: np.ndarray
    impacts: np.ndarray


def rocking(
    block: Block,
    tilt: float,
    ratios: float | list[float],
    *,
    rate: float = 500.0,
    noise: float = 2e-4,
    impacts: int = 12,
    held: float = 0.0,
    begin: float = 0.0,
    zero: float = 0.0,
    uneven: float = 0.0,
    flip: Callable[[int], float] = lambda _: -1.0,
    seed: int = 0,
) -> Rocking:
    """Return a block let go at `tilt`, sampled until the impact after the last of `impacts`.

    `flip`: what the sign of the rotation is multiplied by at each impact (1: it bounces). `uneven`: relative change of
    the slenderness on the +x side, and the opposite one on the other.
    """
    known = [ratios] * impacts if isinstance(ratios, float) else ratios
    side = float(np.sign(tilt))
    sides = {s: _changed(block, 1.0 + s * uneven) for s in (-1.0, 1.0)}
    first = simulate(sides[side], initial_rotation=tilt, restitution=0.5)
    ends, speed = [float(first.impact_times[0])], abs(float(first.impact_rates[0]))
    flights = [(0.0, first)]
    for number, ratio in enumerate(known):
        side *= flip(number)
        speed *= ratio
        flight = simulate(sides[side], initial_angular_velocity=side * speed, restitution=0.5)
        flights.append((ends[-1], flight))
        ends.append(ends[-1] + float(flight.impact_times[0]))
    time = np.arange(begin - held, ends[-1], 1.0 / rate)
    rotation = np.where(time < 0.0, tilt, 0.0)
    for (start, flight), end in zip(flights, ends, strict=True):
        inside = (time >= start) & (time < end)
        rotation[inside] = flight.rotation(time[inside] - start)
    noisy = rotation + zero + noise * np.random.default_rng(seed).standard_normal(time.size)
    return Rocking(time, noisy, np.array(ends))


def _changed(block: Block, factor: float) -> Block:
    alpha, diagonal = block.slenderness * factor, 2.0 * block.half_diagonal
    return Block(float(diagonal * np.sin(alpha)), float(diagonal * np.cos(alpha)))
