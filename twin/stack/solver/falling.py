"""Blocks that leave the stack: overturned, or no longer held by their pivot."""

from __future__ import annotations

from twin.stack.solver.book import LEFT, LOST, OVERTURNED, STOPPED, Book, hold, note
from twin.stack.solver.chain import BLOCKS, FALLING, FALLS, FRESH, TIME, Chain, Place, State, set_out
from twin.stack.solver.chain import LOST as WHEN_LOST
from twin.stack.solver.compiled import lent


@lent
def fall(chain: Chain, which: int, state: State, book: Book) -> None:
    """Take block `which` and all on it off the stack: they have overturned now."""
    hold(state, book)
    _leave(which, state)
    note(chain, book, state, OVERTURNED, which, 0.0, 1)


@lent
def lose(chain: Chain, n: int, which: int, state: State, place: Place, book: Book) -> bool:
    """Deal with the pivot of interface `which`, that would have to pull; False where the run ends with that.

    It goes on, without what is falling for good, only where that is asked for (FALLS) and there is such a part.
    """
    hold(state, book)
    gone = falling_from(chain, n, which, state, place)
    state.clock[FALLING] = gone
    if chain.scales[WHEN_LOST] != FALLS or gone < 0:
        note(chain, book, state, LOST, which, 0.0, STOPPED)
        return False
    _leave(gone, state)
    note(chain, book, state, LOST, gone, 0.0, LEFT)
    return True


@lent
def falling_from(chain: Chain, n: int, which: int, state: State, place: Place) -> int:
    """Return the lowest interface, not above `which`, whose part falls for good, or -1.

    Such a part, everything above that interface, is past its balance: its centre of mass lies outside the pivot, and
    its lowest block turns outwards.
    """
    set_out(chain, n, state.side, state.gap, place)
    spin = 0.0
    for i in range(which + 1):
        spin += state.rate[i]
        lever = 0.0
        for k in range(i, n):
            lever += chain.mass[k] * (place.centre[k, 0] - place.pivot[i, 0])
        if state.side[i] * lever > 0.0 and state.side[i] * spin > 0.0:
            return i
    return -1


@lent
def _leave(which: int, state: State) -> None:
    angle = 0.0
    for i in range(int(state.clock[BLOCKS])):
        angle += state.gap[i]
        if i >= which:
            state.fallen[i] = state.clock[TIME]
            state.lying[i] = angle
            state.side[i] = 0.0
            state.gap[i] = 0.0
            state.rate[i] = 0.0
    state.clock[BLOCKS] = which
    state.clock[FRESH] = 1.0
