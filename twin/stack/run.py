"""One run of the stack's solver from Python: numbers in, recorded steps and events out."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from twin.rocking.compiled import FloatArray
from twin.rocking.run import STILL_BASE
from twin.stack.solver.book import Book, new_book
from twin.stack.solver.chain import AT_REST, BLOCKS, FALLING, FRESH, LIFTED, PIECE, TIME, Chain, P, State, new_state
from twin.stack.solver.energy import safe
from twin.stack.solver.march import FULL, REACHED, Bench, march_through, new_bench


def initial_state(chain: Chain, rotations: FloatArray, rates: FloatArray) -> State:
    """Return the solver's state for absolute rotations (rad) and rates (rad/s) at time 0; no gap, no rate: closed."""
    state = new_state(len(rotations))
    state.gap[:] = np.diff(rotations, prepend=0.0)
    state.rate[:] = np.diff(rates, prepend=0.0) / chain.scales[P]
    state.side[:] = np.where(state.gap != 0.0, np.sign(state.gap), np.sign(state.rate))
    state.peak[:] = np.abs(rotations)
    state.clock[LIFTED] = float(np.any(state.side))
    return state


@dataclass(slots=True)
class Run:
    """A state being advanced, and what it leaves behind."""

    chain: Chain
    state: State
    code: int = REACHED
    _still: bool = False
    _book: Book = field(init=False)
    _bench: Bench = field(init=False)

    def __post_init__(self) -> None:
        n = len(self.state.gap)
        self._book = new_book(n, 128, 128)
        self._bench = new_bench(n)

    @property
    def steps(self) -> FloatArray:
        """Recorded steps: see `twin.stack.solver.book`."""
        return self._book.steps[: int(self._book.used[0])]

    @property
    def events(self) -> FloatArray:
        """Recorded events: see `twin.stack.solver.book`."""
        return self._book.events[: int(self._book.used[1])]

    def advance(self, pieces: FloatArray, end: float = math.inf) -> int:
        """Go through `pieces`, then over a still base, to time `end`; return the compiled code's reason to stop."""
        if self._through(pieces, end) == REACHED and self.time < end:
            self._still = True
            self._through(STILL_BASE, end)
        return self.code

    def _through(self, pieces: FloatArray, end: float) -> int:
        self.state.clock[PIECE] = 0.0
        self.state.clock[FRESH] = 1.0
        while True:
            self.code = march_through(self.chain, self.state, pieces, end, False, self._bench, self._book)
            if self.code != FULL:
                return self.code
            steps, events, used, before = self._book
            steps = np.concatenate([steps, np.empty_like(steps)])
            events = np.concatenate([events, np.empty_like(events)])
            self._book = Book(steps, events, used, before)

    @property
    def time(self) -> float:
        """Time reached, s."""
        return float(self.state.clock[TIME])

    @property
    def standing(self) -> int:
        """Blocks that still stand."""
        return int(self.state.clock[BLOCKS])

    @property
    def safe(self) -> bool:
        """Whether the base is still for good and nothing that stands can ever fall."""
        n = self.standing
        return self._still and n > 0 and bool(safe(self.chain, n, self.state, self._bench.place))

    @property
    def lifted(self) -> bool:
        """Whether anything has opened so far."""
        return bool(self.state.clock[LIFTED] != 0.0)

    @property
    def resting(self) -> bool:
        """Whether what stands stands still."""
        return not np.any(self.state.side)

    @property
    def rest_time(self) -> float:
        """When all interfaces closed last, s."""
        return float(self.state.clock[AT_REST])

    @property
    def falling_from(self) -> int:
        """Contact lost: the interface above which all was falling for good, or -1."""
        return int(self.state.clock[FALLING])
