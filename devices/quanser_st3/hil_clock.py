"""The board's own sampling as the clock of a run: its blocking read is what the cycle waits for."""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING

from devices.errors import DeviceError

if TYPE_CHECKING:
    from collections.abc import Callable

    from devices.clock import Clock
    from devices.quanser_st3.hil_card import HilCard, Reading

DRIFT = 200e-6
"""How far the board's clock may differ from the computer's, s per s; what is more is lateness."""
READ_LIMIT = 0.1
"""Time after which a read that waits is ended, s; it takes twice that at most."""
# A read that took less of a cycle than this found its sample waiting.
_AT_ONCE = 0.05
# So many in a row may be old ones: they are read until one has to be waited for.
_SUSPICIOUS = 20
_MOST_OLD = 200


class SampleClock:
    """A clock whose cycles are the board's samples. Pace the cycles of a run by it, and by nothing else.

    While the board samples, `wait_until` reads until the sample of that moment is there; how late the computer came to
    it is told by the computer's clock, with the two clocks' drift taken out. Before and after it is the computer's.

    Paced by another clock, samples would pile up and a position loop be closed on old ones; they are then found by the
    reads that need not wait, and skipped.

    Parameters
    ----------
    card : HilCard
        Open.
    cycle_time : float
        s.
    wall : Clock
        The computer's.

    Attributes
    ----------
    running : bool
        Whether the board samples.
    change : int
        Counts of the table's encoder between the last two samples, which are a cycle apart.
    """

    def __init__(self, card: HilCard, cycle_time: float, wall: Clock) -> None:
        self.running = False
        self.change = 0
        self._card = card
        self._step = cycle_time
        self._wall = wall
        self._guard = ReadGuard(card.interrupt, READ_LIMIT)
        self._phase = 0.0
        self._sampled = 0.0
        self._awaited: float | None = None
        self._count: int | None = None
        self._fresh: Reading | None = None
        self._at_once = 0
        self._error: DeviceError | None = None

    def now(self) -> float:
        """Return the time, s."""
        return self._wall.now() - self._phase

    def wait_until(self, moment: float) -> float:
        """Return when the sample of `moment`, s, is there; the lateness, s, is returned and never negative.

        What goes wrong meanwhile is raised by the next `take`.
        """
        self._awaited = moment
        if not self.running:
            return self._wall.wait_until(moment + self._phase)
        try:
            while self._error is None and self._sampled + 0.5 * self._step < moment:
                self._fresh = self._next()
        except DeviceError as error:
            self._error = error
        return max(0.0, self.now() - moment)

    def start(self) -> None:
        """Let the board sample; its first sample belongs to the moment that was awaited last."""
        self._card.start()
        self.running, self._error, self._count, self._at_once = True, None, None, 0
        self._guard.start()
        self._fresh = self._read()
        self._sampled = self.now() if self._awaited is None else self._awaited
        self._phase = self._wall.now() - self._sampled
        self._card.watch()

    def take(self) -> Reading:
        """Return the sample that was waited for, or wait for the next one.

        Raises
        ------
        BusFailure, DriveStopped
            Where board or watchdog failed since.
        """
        if self._error is not None:
            raise self._error
        reading, self._fresh = self._fresh, None
        return self._next() if reading is None else reading

    def stop(self) -> None:
        """End sampling, with the output at 0 V; raises `BusFailure` where that failed."""
        self.running, self._fresh, self._awaited = False, None, None
        try:
            self._card.stop()
        finally:
            self._guard.stop()

    def _next(self) -> Reading:
        reading = self._read()
        self._card.reload()
        if self._at_once >= _SUSPICIOUS:
            for _ in range(_MOST_OLD):
                if self._at_once == 0:
                    break
                reading = self._read()
                self._card.reload()
            self._at_once = 0
        self._sampled += self._step
        offset = self._wall.now() - self._sampled
        self._phase = min(self._phase + DRIFT * self._step, offset)
        return reading

    def _read(self) -> Reading:
        before = self._wall.now()
        with self._guard:
            reading = self._card.read()
        waited = self._wall.now() - before > _AT_ONCE * self._step
        self._at_once = 0 if waited else self._at_once + 1
        self.change = 0 if self._count is None else reading.encoder - self._count
        self._count = reading.encoder
        return reading


class ReadGuard:
    """Ends a read that waits for too long: `with guard: read()`.

    Parameters
    ----------
    interrupt : callable
        Called from another thread; lets the read return.
    limit : float
        s.
    """

    def __init__(self, interrupt: Callable[[], None], limit: float) -> None:
        self._interrupt = interrupt
        self._limit = limit
        self._reads = 0
        self._waiting = False
        self._over = threading.Event()
        self._thread: threading.Thread | None = None

    def start(self) -> None:
        """Begin to look at the reads."""
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._watch, args=(self._over,), name="HIL read guard", daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """End it."""
        self._over.set()
        if self._thread is not None:
            self._thread.join(2.0 * self._limit)
            self._thread = None

    def __enter__(self) -> None:
        self._waiting = True

    def __exit__(self, *_: object) -> None:
        self._waiting = False
        self._reads += 1

    def _watch(self, over: threading.Event) -> None:
        seen = -1
        while not over.wait(self._limit):
            if self._waiting and self._reads == seen:
                self._interrupt()
            seen = self._reads
