"""Write a run to an MCAP file: protobuf with its descriptors inside, small LZ4 chunks, so that a crash loses little."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING

from recordings import foxglove
from recordings.can_traffic import frame_numbers
from recordings.chunked_file import ChunkedFile
from recordings.clock_fit import ClockFit
from recordings.descriptors import descriptor_set
from recordings.disk_file import DiskFile
from recordings.errors import RecordingError
from recordings.geometry import METADATA_NAME as GEOMETRY_METADATA
from recordings.packing import Numbers, Packing
from recordings.schema import (
    BLOCK_MEASURED,
    BLOCK_PREDICTED,
    CAN_FRAME,
    CLOCK_METADATA,
    CYCLE,
    ESTIMATE,
    EVENT_TIME,
    EVENTS_TOPIC,
    FORECAST,
    MISSED,
    RECORDER_METADATA,
    RECOVERY_METADATA,
    SCENE_TOPIC,
    SCHEMA_METADATA,
    TABLE_MEASURED,
    TABLE_TARGET,
    TRANSFORMS_TOPIC,
    VERSION,
    WELL_KNOWN,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from recordings.geometry import Geometry
    from recordings.topic import Topic
    from twin.cycle import CanFrame, CycleRecord, Event, Missed

FLUSH_INTERVAL = 0.05
"""Most time between two writes to the file, s: what a killed process loses."""
SYNC_INTERVAL = 0.1
"""Most time between two fsync, s: what a power cut loses."""
TRANSFORM_INTERVAL_NS = 20_000_000
"""Least table time between two poses, ns (50 Hz: a viewer draws no more)."""
SENSIBLE_TIME = 1e9
"""Largest time of the table's clock that is put into `publish_time`, s (30 years)."""
LIBRARY = "shake-table-twin"

_RESERVED = frozenset({SCHEMA_METADATA, CLOCK_METADATA, GEOMETRY_METADATA, RECORDER_METADATA, RECOVERY_METADATA})
_UINT32, _UINT64 = 0xFFFF_FFFF, 0xFFFF_FFFF_FFFF_FFFF
_FORECAST, _ESTIMATE = Numbers(FORECAST), Numbers(ESTIMATE)


class RunWriter:
    """A `twin.cycle.Sink` and `FrameSink` that is a file.

    Parameters
    ----------
    path : Path
        File to make; its folder is made too.
    metadata : mapping of name to mapping of str to str
        What explains the run (scene, versions, clip report, ...), written first.
    geometry : Geometry or None
        Size of the block; without it no poses are written.
    overwrite : bool
        Replace a file of that name.
    disk : callable
        Opens the file; tests give one that fails.

    Raises
    ------
    RecordingError
        The file exists and `overwrite` is False, the folder cannot be written, or a metadata name is reserved.

    Notes
    -----
    Not thread-safe. `cycle`, `missed`, `event` and `frame` may block on the disk and raise OSError (a full disk), so a
    control loop hands its samples to a `Recorder`, which runs this in a process of its own. Whatever fails, the file
    ends with a whole record, and everything up to `safe` is in it.
    """

    def __init__(
        self,
        path: Path,
        metadata: Mapping[str, Mapping[str, str]],
        geometry: Geometry | None = None,
        *,
        overwrite: bool = False,
        disk: Callable[[Path, str], DiskFile] = DiskFile,
    ) -> None:
        for name in _RESERVED & set(metadata):
            raise RecordingError(f"metadata name '{name}' is reserved for the recording itself")
        self.path = Path(path)
        self.written = self.safe = self._in_file = 0
        self._geometry = geometry
        self._clock = ClockFit()
        self._origin_ns: int | None = None
        self._next_pose_ns = 0
        self._last_ns = 0
        self._events = self._frames = 0
        self._flushed_at = self._synced_at = -math.inf
        if self.path.exists() and not overwrite:
            raise RecordingError(f"{self.path} exists already and is not overwritten")
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            self._file = disk(self.path, "wb" if overwrite else "xb")
        except OSError as error:
            raise RecordingError(f"{self.path} cannot be written: {error.strerror}") from None
        try:
            self._mcap = ChunkedFile(self._file, LIBRARY)
            self._begin(metadata)
        except OSError as error:
            self._file.close()
            self.path.unlink(missing_ok=True)
            raise RecordingError(f"{self.path} cannot be written: {error.strerror}") from None

    def _begin(self, metadata: Mapping[str, Mapping[str, str]]) -> None:
        major, minor = VERSION
        self._mcap.metadata(SCHEMA_METADATA, {"major": str(major), "minor": str(minor)})
        self._packed: dict[str, Packing] = {}
        self._foxglove: dict[str, int] = {}
        # In the order of `CYCLE_TOPICS`; all other topics are in the file from their first message on.
        self._target, self._measured = self._packing(TABLE_TARGET), self._packing(TABLE_MEASURED)
        self._block, self._predicted = self._packing(BLOCK_MEASURED), self._packing(BLOCK_PREDICTED)
        self._cycle = self._packing(CYCLE)
        if self._geometry is not None:
            self._mcap.metadata(GEOMETRY_METADATA, self._geometry.to_metadata())
        for name, values in metadata.items():
            self._mcap.metadata(name, values)
        self._sync()

    def cycle(self, record: CycleRecord) -> None:
        """Write one cycle."""
        host = record.host_time_ns
        table = self._table_ns(record.time, host)
        sequence = record.cycle & _UINT32
        if abs(record.time) <= SENSIBLE_TIME:
            self._clock.add(record.time, host)
        self._add(self._target, host, table, sequence, record.target_position)
        self._add(self._measured, host, table, sequence, record.position, record.acceleration, record.status)
        self._add(self._block, host, table, sequence, record.rotation)
        self._add(self._predicted, host, table, sequence, record.predicted_rotation, record.predicted_angular_velocity)
        self._add(self._cycle, host, table, sequence, record.cycle, record.time, record.lateness)
        if record.forecast is not None:
            self._add(self._packing(FORECAST), host, table, sequence, *_FORECAST.of(record.forecast))
        if record.estimate is not None:
            self._add(self._packing(ESTIMATE), host, table, sequence, *_ESTIMATE.of(record.estimate))
        self._last_ns = table
        if table >= self._next_pose_ns and self._geometry is not None:
            self._poses(record, table, self._geometry)
        self._wrote()

    def missed(self, missed: Missed) -> None:
        """Write a gap; its `publish_time` is that of the last cycle before it."""
        host, table = missed.host_time_ns, self._last_ns or missed.host_time_ns
        self._add(self._packing(MISSED), host, table, missed.first & _UINT32, missed.first, missed.last)
        self._wrote()

    def event(self, event: Event) -> None:
        """Write an event: its text as foxglove.Log, and its exact time beside it."""
        host, table = event.host_time_ns, self._table_ns(event.time, event.host_time_ns)
        text = foxglove.log_message(table, event.level, event.name, event.message)
        sequence = self._events & _UINT32
        self._add(self._packing(EVENT_TIME), host, table, sequence, event.time)
        self._mcap.message(self._channel(EVENTS_TOPIC), sequence, host, table, text)
        self._events += 1
        self._wrote()

    def frame(self, frame: CanFrame) -> None:
        """Write a CAN frame; it has no time on the table's clock, so `publish_time` is the host's too."""
        host = frame.host_time_ns
        self._add(self._packing(CAN_FRAME), host, host, self._frames & _UINT32, *frame_numbers(frame))
        self._frames += 1
        self._wrote()

    def tick(self, now: float) -> None:
        """Write and fsync where the intervals are over; `now` is any monotonic clock, s."""
        if now - self._synced_at >= SYNC_INTERVAL:
            self._flush()
            self._sync()
            self._flushed_at = self._synced_at = now
        elif now - self._flushed_at >= FLUSH_INTERVAL:
            self._flush()
            self._flushed_at = now

    def finish(self, metadata: Mapping[str, Mapping[str, str]] | None = None) -> None:
        """Write closing metadata (statistics, verdict), the index, and close the file; a second call does nothing.

        Where the last values cannot be written any more, what is there is still brought to the disk, and closed
        properly if that can be.

        Raises
        ------
        OSError
            Something could not be written.
        """
        if self._file.closed:
            return
        try:
            try:
                self._flush()
            except OSError:
                self._mcap.discard()
                self._sync()
                self._close(metadata or {})
                raise
            self._close(metadata or {})
            self.safe = self._in_file
        finally:
            self._file.close()

    def _flush(self) -> None:
        self._mcap.flush()
        self._in_file = self.written

    def _sync(self) -> None:
        self._file.sync()
        self.safe = self._in_file

    def _close(self, metadata: Mapping[str, Mapping[str, str]]) -> None:
        if clock := self._clock.to_metadata():
            self._mcap.metadata(CLOCK_METADATA, clock)
        for name, values in metadata.items():
            self._mcap.metadata(name, values)
        self._mcap.finish()

    def _packing(self, topic: Topic) -> Packing:
        """Give the packing of a topic of ours; its channel is opened at the first call."""
        if topic.name not in self._packed:
            schema = self._mcap.schema(topic.schema_name, descriptor_set(topic))
            words = {field.name: field.words for field in topic.fields}
            self._packed[topic.name] = Packing(topic, self._mcap.channel(topic.name, schema, words))
        return self._packed[topic.name]

    def _channel(self, topic: str) -> int:
        """Give the channel of a topic of Foxglove's; it is opened at the first call."""
        if topic not in self._foxglove:
            name = WELL_KNOWN[topic]
            self._foxglove[topic] = self._mcap.channel(
                topic, self._mcap.schema(name, foxglove.well_known_schemas()[name])
            )
        return self._foxglove[topic]

    def _add(self, packing: Packing, host: int, table: int, sequence: int, *values: float) -> None:
        self._mcap.add(packing.channel, host, packing.record(sequence, host, table, *values))

    def _wrote(self) -> None:
        self.written += 1
        if self._mcap.full:
            self._flush()

    def _table_ns(self, time: float, host_ns: int) -> int:
        # Unsigned 64 bits in the file: a clock that makes no sense must not stop the recording of the rest.
        if not abs(time) <= SENSIBLE_TIME:
            return host_ns
        offset = round(time * 1e9)
        if self._origin_ns is None:
            self._origin_ns = max(host_ns - offset, 0)
            self._mcap.metadata(CLOCK_METADATA, {"origin_ns": str(self._origin_ns)})
            if self._geometry is not None:
                scene = foxglove.scene_message(self._origin_ns, self._geometry)
                self._mcap.message(self._channel(SCENE_TOPIC), 0, host_ns, self._origin_ns, scene)
        return min(max(self._origin_ns + offset, 0), _UINT64)

    def _poses(self, record: CycleRecord, table: int, geometry: Geometry) -> None:
        channel, host, sequence = self._channel(TRANSFORMS_TOPIC), record.host_time_ns, record.cycle & _UINT32
        if math.isfinite(record.position):
            self._mcap.message(channel, sequence, host, table, foxglove.table_transform(table, record.position))
        for frame, rotation in (
            (foxglove.BLOCK_MEASURED, record.rotation),
            (foxglove.BLOCK_PREDICTED, record.predicted_rotation),
        ):
            if math.isfinite(rotation):
                pose = foxglove.block_transform(table, frame, rotation, geometry)
                self._mcap.message(channel, sequence, host, table, pose)
        self._next_pose_ns = table + TRANSFORM_INTERVAL_NS
