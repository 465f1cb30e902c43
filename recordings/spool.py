"""Hand what a control loop produces to another process, without ever blocking or raising into the loop.

The loop packs a value with `struct` and appends it to a bounded queue; a thread sends the queue's content through a
pipe every few milliseconds; the other process feeds it to a consumer: a file, a viewer.

Where the queue is full (the consumer is stuck for longer than the queue is deep), the newest value is dropped and
counted: what is already queued stays without holes. Events and missed cycles have places of their own beyond the
bound, so a flood of cycles cannot push them out.
"""

from __future__ import annotations

import atexit
import json
import multiprocessing
import struct
import threading
from collections import deque
from typing import TYPE_CHECKING, Protocol, TypeVar

from devices.clock import WallClock
from devices.scheduling import PRIORITY, real_time
from recordings.consumer import Frame, consume, pack_cycle, pack_event, pack_missed
from recordings.errors import RecordingError

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from recordings.consumer import Consumer
    from twin.cycle import CycleRecord, Event, Missed

SEND_INTERVAL = 0.01
"""Time between two batches, s."""
BATCH_LIMIT = 500
"""Most values of a batch: between two batches the consumer looks whether it must flush."""
EVENT_RESERVE = 1000
"""Places of the queue that only events and missed cycles may take."""
START_LIMIT = 60.0
"""Most time a new process may take to be ready, s: a loaded laboratory machine imports slowly."""

_CLOCK = WallClock()
# What packing a value of the wrong kind raises.
_REFUSED = (struct.error, TypeError, ValueError, OverflowError, AttributeError)
_Value = TypeVar("_Value")


class _Counter(Protocol):
    value: int


class Spool:
    """A `twin.cycle.Sink` whose consumer lives in a process of its own.

    Parameters
    ----------
    build : callable
        Makes the consumer, in the other process; must be picklable (a `functools.partial` of a class).
    name : str
        What it is, for sentences: "recorder", "viewer".
    bound : int
        Cycles the queue holds.

    Raises
    ------
    RecordingError
        The consumer could not be made; its own sentence.

    Attributes
    ----------
    dropped : int
        Values dropped because the queue was full.
    refused : int
        Values that could not be packed (a field of the wrong type).
    alive : bool
        False once the process died or the pipe broke; from then on every value counts as lost.
    failure : str or None
        Why it is not alive, one sentence.
    """

    def __init__(self, build: Callable[[], Consumer], *, name: str, bound: int = 20_000) -> None:
        context = multiprocessing.get_context("spawn")
        self.dropped = self.refused = self._received = 0
        self.alive = True
        self.failure: str | None = None
        self._name = name
        self._bound = bound
        self._queue: deque[bytes] = deque()
        self._closing = threading.Event()
        self._closing_frame = b""
        self._safe: _Counter = context.RawValue("Q", 0)
        inbox, self._outlet = context.Pipe(duplex=False)
        self._replies, replies = context.Pipe(duplex=False)
        self._process = context.Process(target=consume, args=(build, inbox, replies, self._safe), name=f"twin {name}")
        self._process.start()
        # Registered after the start, so that it runs before multiprocessing joins its children at exit: the child ends
        # when its pipe closes, and would otherwise be waited for without end.
        atexit.register(self.close)
        inbox.close()
        replies.close()
        self._thread = threading.Thread(target=self._send, name=f"twin {name} sender", daemon=True)
        self._await_ready()
        self._thread.start()

    def cycle(self, record: CycleRecord) -> None:
        """Take a cycle; never blocks, never raises."""
        self._take(pack_cycle, record, self._bound)

    def missed(self, missed: Missed) -> None:
        """Take a gap; never blocks, never raises."""
        self._take(pack_missed, missed, self._bound + EVENT_RESERVE)

    def event(self, event: Event) -> None:
        """Take an event; never blocks, never raises."""
        self._take(pack_event, event, self._bound + EVENT_RESERVE)

    @property
    def received(self) -> int:
        """Values taken so far, dropped ones not among them."""
        return self._received

    @property
    def safe(self) -> int:
        """Values the consumer has put where nothing can take them away (for a file: after fsync)."""
        return self._safe.value

    def close(self, metadata: Mapping[str, Mapping[str, str]] | None = None, *, limit: float = 10.0) -> None:
        """Send what is queued and `metadata`, and let the process end; after `limit` seconds it is ended by force.

        A second call does nothing.
        """
        if self._closing.is_set():
            return
        self._closing_frame = bytes([Frame.FINISH]) + json.dumps(metadata or {}).encode()
        deadline = _CLOCK.now() + limit
        atexit.unregister(self.close)
        self._closing.set()
        if self._thread.ident is not None:
            self._thread.join(limit)
        self._process.join(max(deadline - _CLOCK.now(), 0.0) if self.alive else 0.2)
        if self._process.is_alive():
            self._give_up(f"the {self._name} process did not end within {limit:g} s")
            self._process.terminate()
            self._process.join(0.5)
            if self._process.is_alive():
                self._process.kill()
                self._process.join(0.5)
        self._take_reply()
        if self._process.exitcode not in (0, None):
            self._give_up(f"the {self._name} process ended with exit code {self._process.exitcode}")
        self._replies.close()

    def _take(self, pack: Callable[[_Value], bytes], value: _Value, bound: int) -> None:
        try:
            packed = pack(value)
        except _REFUSED:
            self.refused += 1
            return
        if len(self._queue) >= bound:
            self.dropped += 1
        else:
            self._received += 1
            if self.alive:
                self._queue.append(packed)

    def _await_ready(self) -> None:
        answer = b""
        try:
            if self._replies.poll(START_LIMIT):
                answer = self._replies.recv_bytes()
        except (EOFError, OSError):
            pass
        if answer == b"ready":
            return
        self._outlet.close()
        self.alive = False
        reason = answer.decode() if answer else f"the {self._name} process did not start"
        self.close(limit=1.0)
        raise RecordingError(reason)

    def _send(self) -> None:
        # It shares the interpreter's lock with the cycle: an ordinary thread that is put off while it holds that lock
        # would keep a real-time cycle waiting for milliseconds.
        with real_time(PRIORITY - 1):
            self._send_batches()

    def _send_batches(self) -> None:
        queue = self._queue
        try:
            while True:
                closing = self._closing.wait(0.0 if len(queue) >= BATCH_LIMIT else SEND_INTERVAL)
                if batch := [queue.popleft() for _ in range(min(len(queue), BATCH_LIMIT))]:
                    self._outlet.send_bytes(bytes([Frame.BATCH]) + b"".join(batch))
                elif closing:
                    self._outlet.send_bytes(self._closing_frame)
                    break
                elif not self._process.is_alive():
                    raise BrokenPipeError
        except (OSError, ValueError):
            self._take_reply()
            self._give_up(f"the {self._name} process died")
            queue.clear()
        finally:
            self._outlet.close()

    def _take_reply(self) -> None:
        try:
            while self._replies.poll():
                self._give_up(f"the {self._name} process stopped: {self._replies.recv_bytes().decode()}")
        except (EOFError, OSError):
            pass

    def _give_up(self, reason: str) -> None:
        self.alive = False
        if self.failure is None:
            self.failure = reason
