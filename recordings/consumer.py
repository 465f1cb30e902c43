"""The other end of a `Spool`: unpack what comes through the pipe and feed it to a consumer."""

from __future__ import annotations

import contextlib
import json
import os
import signal
from enum import IntEnum
from struct import Struct
from typing import TYPE_CHECKING, Protocol, cast

from devices.clock import WallClock
from recordings.errors import RecordingError
from recordings.packing import Numbers
from recordings.schema import ESTIMATE, FAILURE_KEY, FORECAST, RECORDER_METADATA
from twin.cycle import CanFrame, CycleRecord, Estimated, Event, Forecasted, Level, Missed, Sink

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from multiprocessing.connection import Connection

    from twin.cycle import FrameSink

POLL_INTERVAL = 0.02
"""Longest wait for data before the consumer may flush, s."""
NICENESS = 5
"""How far the process stands back behind the control loop, where the system knows niceness."""

_LEVELS: tuple[Level, ...] = ("info", "warning", "error")
_TEXT_LIMIT = 0xFFFF
# First byte of each packed value.
_CYCLE_KIND, _MISSED_KIND, _EVENT_KIND, _FRAME_KIND = 1, 2, 3, 4
_CYCLE = Struct("<BBQdQdddddddI")
_MISSED = Struct("<BQQQ")
_EVENT = Struct("<BdQBHH")
_FRAME = Struct("<BQI?B8s")
# Second byte of a cycle: what follows it.
_HAS_FORECAST, _HAS_ESTIMATE = 1, 2
_FORECAST_NUMBERS, _ESTIMATE_NUMBERS = Numbers(FORECAST), Numbers(ESTIMATE)
_FORECAST, _ESTIMATE = Struct("<" + _FORECAST_NUMBERS.layout), Struct("<" + _ESTIMATE_NUMBERS.layout)


class Frame(IntEnum):
    """First byte of what one send through the pipe holds."""

    BATCH = 0
    FINISH = 1


class Consumer(Sink, Protocol):
    """A sink that is told the time, counts what is safe, and can be finished."""

    safe: int

    def tick(self, now: float) -> None: ...

    def finish(self, metadata: Mapping[str, Mapping[str, str]] | None = None) -> None: ...


class _Shared(Protocol):
    value: int


def pack_cycle(record: CycleRecord) -> bytes:
    """Pack a cycle; struct.error or ValueError where a field is of the wrong type or range."""
    more, parts = 0, b""
    if record.forecast is not None:
        more, parts = _HAS_FORECAST, _FORECAST.pack(*_FORECAST_NUMBERS.of(record.forecast))
    if record.estimate is not None:
        more, parts = more | _HAS_ESTIMATE, parts + _ESTIMATE.pack(*_ESTIMATE_NUMBERS.of(record.estimate))
    packed = _CYCLE.pack(
        _CYCLE_KIND,
        more,
        record.cycle,
        record.time,
        record.host_time_ns,
        record.lateness,
        record.target_position,
        record.position,
        record.acceleration,
        record.rotation,
        record.predicted_rotation,
        record.predicted_angular_velocity,
        record.status,
    )
    return packed + parts if parts else packed


def pack_missed(missed: Missed) -> bytes:
    """Pack a gap; struct.error where a field is of the wrong type or range."""
    return _MISSED.pack(_MISSED_KIND, missed.first, missed.last, missed.host_time_ns)


def pack_event(event: Event) -> bytes:
    """Pack an event; texts are cut at 65535 bytes of UTF-8."""
    name, message = (text.encode("utf-8", "replace")[:_TEXT_LIMIT] for text in (event.name, event.message))
    level = _LEVELS.index(event.level)
    return _EVENT.pack(_EVENT_KIND, event.time, event.host_time_ns, level, len(name), len(message)) + name + message


def pack_frame(frame: CanFrame) -> bytes:
    """Pack a CAN frame; ValueError where it has more than 8 bytes."""
    if len(frame.data) > 8:
        raise ValueError(f"a CAN frame has {len(frame.data)} bytes; 8 is the most")
    return _FRAME.pack(_FRAME_KIND, frame.host_time_ns, frame.identifier, frame.sent, len(frame.data), frame.data)


def unpack(batch: bytes, sink: Sink) -> int:
    """Feed packed values to `sink`, in order, and say how many they were.

    >>> from twin.cycle import Event
    >>> class Printer:
    ...     def cycle(self, record): pass
    ...     def missed(self, missed): pass
    ...     def event(self, event): print(event.time, event.name)
    >>> unpack(pack_event(Event(0.25, 0, "info", "uplift", "the block lifted")), Printer())
    0.25 uplift
    1
    """
    offset = count = 0
    while offset < len(batch):
        kind = batch[offset]
        if kind == _CYCLE_KIND:
            _, more, *values = _CYCLE.unpack_from(batch, offset)
            offset += _CYCLE.size
            if more & _HAS_FORECAST:
                values.append(Forecasted(*_FORECAST_NUMBERS.values(_FORECAST.unpack_from(batch, offset))))
                offset += _FORECAST.size
            elif more:
                values.append(None)
            if more & _HAS_ESTIMATE:
                values.append(Estimated(*_ESTIMATE.unpack_from(batch, offset)))
                offset += _ESTIMATE.size
            sink.cycle(CycleRecord(*values))
        elif kind == _MISSED_KIND:
            _, first, last, host = _MISSED.unpack_from(batch, offset)
            offset += _MISSED.size
            sink.missed(Missed(first, last, host))
        elif kind == _FRAME_KIND:
            _, host, identifier, sent, length, data = _FRAME.unpack_from(batch, offset)
            offset += _FRAME.size
            cast("FrameSink", sink).frame(CanFrame(host, identifier, data[:length], sent))
        else:
            _, moment, host, level, name_length, message_length = _event_fields(batch, offset)
            start = offset + _EVENT.size
            middle, offset = start + name_length, start + name_length + message_length
            name, message = (part.decode("utf-8", "ignore") for part in (batch[start:middle], batch[middle:offset]))
            sink.event(Event(moment, host, _LEVELS[level], name, message))
        count += 1
    return count


def _event_fields(batch: bytes, offset: int) -> tuple[int, float, int, int, int, int]:
    return _EVENT.unpack_from(batch, offset)


def consume(build: Callable[[], Consumer], inbox: Connection, replies: Connection, safe: _Shared) -> None:
    """Run in the other process: build the consumer, feed it until the pipe closes, finish it.

    Ctrl-C, and the end of a terminal, reach every process in it: only the producer may answer them. A producer that
    dies closes the pipe; the consumer is then finished too and told why, so that its file is whole and says what
    happened.
    """
    for name in ("SIGINT", "SIGTERM", "SIGHUP", "SIGBREAK"):
        if hasattr(signal, name):
            signal.signal(getattr(signal, name), signal.SIG_IGN)
    if hasattr(os, "nice"):
        os.nice(NICENESS)
    with contextlib.suppress(BrokenPipeError):
        try:
            consumer = build()
        except RecordingError as error:
            replies.send_bytes(str(error).encode())
            return
        replies.send_bytes(b"ready")
        try:
            consumer.finish(_feed(consumer, inbox, safe))
        except OSError as error:
            reason = str(error.strerror or error)
            replies.send_bytes(reason.encode())
            with contextlib.suppress(OSError):
                consumer.finish(_failed(f"recording stopped: {reason}"))
        safe.value = consumer.safe


def _feed(consumer: Consumer, inbox: Connection, safe: _Shared) -> Mapping[str, Mapping[str, str]]:
    """Feed `consumer` until the producer closes, and give the closing metadata."""
    clock = WallClock()
    while True:
        try:
            frame = inbox.recv_bytes() if inbox.poll(POLL_INTERVAL) else b""
        except (EOFError, ConnectionError):
            return _failed("the recorded process ended without closing its recording")
        if frame and frame[0] == Frame.FINISH:
            return json.loads(frame[1:])
        unpack(frame[1:], consumer)
        consumer.tick(clock.now())
        safe.value = consumer.safe


def _failed(failure: str) -> dict[str, dict[str, str]]:
    return {RECORDER_METADATA: {FAILURE_KEY: failure}}
