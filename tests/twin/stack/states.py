"""Stacks in chosen states, and an energy and angular momentum written from scratch for the tests."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np

from tests.facts import B6L as B6L
from twin import Block
from twin.rocking.compiled import FloatArray
from twin.rocking.series import ORDER
from twin.stack.solver.chain import UNILATERAL, P, Place, State, chain_of, new_place, new_state
from twin.stack.solver.groups import gather
from twin.stack.solver.guards import contact_series, gap_series
from twin.stack.solver.impact import strike
from twin.stack.solver.march import Bench, new_bench
from twin.stack.solver.motion import accelerate
from twin.stack.solver.series import motion_series
from twin.stack.stack import Stack

PAIR = Stack([B6L, B6L])
TRIO = Stack([Block(0.09, 0.2, mass=2.0), Block(0.06, 0.27, mass=1.2), Block(0.075, 0.15, mass=0.9)])


def configurations(n: int) -> Iterator[tuple[int, ...]]:
    """Return every moving configuration."""
    return (side for side in itertools.product((-1, 0, 1), repeat=n) if any(side))


@dataclass
class Chained:
    """A stack in one state: sides, absolute rotations (rad) and rates (rad/s)."""

    stack: Stack
    side: Sequence[int]
    rotations: Sequence[float]
    rates: Sequence[float]
    rule: float = UNILATERAL
    state: State = field(init=False)
    place: Place = field(init=False)
    bench: Bench = field(init=False)

    def __post_init__(self) -> None:
        n = len(self.stack)
        self.chain = chain_of(self.stack, rule=self.rule)
        self.p = float(self.chain.scales[P])
        self.state, self.place, self.bench = new_state(n), new_place(n), new_bench(n)
        self.state.side[:] = self.side
        self.state.gap[:] = np.diff(np.array(self.rotations, dtype=float), prepend=0.0)
        self.state.rate[:] = np.diff(np.array(self.rates, dtype=float) / self.p, prepend=0.0)

    @classmethod
    def random(cls, stack: Stack, side: Sequence[int], seed: int, rule: float = UNILATERAL) -> Chained:
        """Return a state of moderate rotations whose open gaps have the right sign."""
        random = np.random.default_rng([seed, *(sign + 1 for sign in side)])
        gaps = np.array(side) * random.uniform(0.01, 0.1, len(side))
        rates = np.abs(side) * random.uniform(-1.0, 1.0, len(side))
        return cls(stack, side, np.cumsum(gaps).tolist(), np.cumsum(rates).tolist(), rule)

    def mirrored(self) -> Chained:
        """Return the state as seen in a mirror."""
        other = Chained(self.stack, self.side, self.rotations, self.rates, self.rule)
        for mine, its in zip(self.state[:3], other.state[:3], strict=True):
            its[:] = -mine
        return other

    def accelerations(self, a: float) -> FloatArray:
        """Return the absolute angular accelerations under base acceleration `a`, rad/s2."""
        s, room = self.state, self.bench.room
        a /= self.p**2
        assert accelerate(self.chain, len(self.stack), s.side, s.gap, s.rate, a, self.place, room)
        return np.cumsum(room.change) * self.p**2

    def series(self, a: float) -> FloatArray:
        """Return the Taylor coefficients of every rotation in powers of p t under constant base acceleration `a`."""
        n, s = len(self.stack), self.bench.series
        groups = gather(self.chain, n, self.state.side, s)
        piece = np.array([0.0, 1.0, a, 0.0, 0.0, 0.0, 0.0])
        assert motion_series(self.chain, n, groups, self.state, piece, 0.0, ORDER, s)
        gap_series(n, self.state, ORDER, s)
        contact_series(self.chain, n, groups, self.state, ORDER, s)
        return np.array([s.angle[g] if g >= 0 else np.zeros(ORDER + 1) for g in s.group])

    def strike(self) -> int:
        """Resolve the impact of every gap that is 0 and closing; return how many candidates there were."""
        return strike(self.chain, len(self.stack), self.state, self.place, self.bench.room)

    def rates_now(self) -> FloatArray:
        """Return the absolute rates, rad/s."""
        return np.cumsum(self.state.rate) * self.p

    def bodies(self, rotations: FloatArray, side: Sequence[float]) -> tuple[FloatArray, FloatArray]:
        """Return centres of mass, shape (n, 2), and pivots, shape (n, 2), from the corners of each block in turn."""
        centres, pivots = [], []
        corner = np.zeros(2)
        under = np.eye(2)
        for i, block in enumerate(self.stack.blocks):
            turn = np.array(
                [[np.cos(rotations[i]), np.sin(rotations[i])], [-np.sin(rotations[i]), np.cos(rotations[i])]]
            )
            reach = np.array([side[i] * self.stack.half_contacts[i], 0.0])
            pivot = corner + under @ reach
            base = pivot - turn @ reach
            centres.append(base + turn @ np.array([0.0, 0.5 * block.height]))
            pivots.append(pivot)
            corner, under = base + turn @ np.array([0.0, block.height]), turn
        return np.array(centres), np.array(pivots)

    def velocities(self, rotations: FloatArray, rates: FloatArray, side: Sequence[float]) -> FloatArray:
        """Return the velocities of the centres of mass, shape (n, 2), by turning every gap about its pivot."""
        centres, pivots = self.bodies(rotations, side)
        result = np.zeros_like(centres)
        for i, gap_rate in enumerate(np.diff(rates, prepend=0.0)):
            arm = centres[i:] - pivots[i]
            result[i:] += gap_rate * np.stack([arm[:, 1], -arm[:, 0]], axis=1)
        return result

    def inertias(self) -> FloatArray:
        """Return the moments of inertia about the centres of mass."""
        size = [(block.width**2 + block.height**2) / 12.0 for block in self.stack.blocks]
        return np.array(self.stack.masses) * np.array(size)

    def kinetic_energy(self, rotations: FloatArray, rates: FloatArray, side: Sequence[float] | None = None) -> float:
        """Return the kinetic energy, in the units of the rates."""
        v = self.velocities(rotations, rates, self.side if side is None else side)
        masses = np.array(self.stack.masses)
        return float(0.5 * np.sum(masses * np.sum(v * v, axis=1)) + 0.5 * np.sum(self.inertias() * rates**2))

    def energy(self, rotations: FloatArray, rates: FloatArray) -> float:
        """Return kinetic and potential energy, J / p2, for rates in units of p."""
        heights = self.bodies(rotations, self.side)[0][:, 1]
        return self.kinetic_energy(rotations, rates) + float(
            np.sum(np.array(self.stack.masses) * heights) * self.stack.gravity / self.p**2
        )

    def angular_momentum(self, part: int, about: FloatArray, rates: FloatArray, side: Sequence[float]) -> float:
        """Return the angular momentum, positive towards +x, of the blocks from `part` up about a point."""
        rotations = np.cumsum(self.state.gap)
        centres, _ = self.bodies(rotations, side)
        v = self.velocities(rotations, rates, side)[part:]
        arm = centres[part:] - about
        masses = np.array(self.stack.masses)[part:]
        return float(
            np.sum(masses * (arm[:, 1] * v[:, 0] - arm[:, 0] * v[:, 1]) + self.inertias()[part:] * rates[part:])
        )
