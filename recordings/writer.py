"""Write a run to an MCAP file: protobuf with its descriptors inside, small LZ4 chunks, so that a crash loses little."""

from __future__ import annotations

import math
import os
from contextlib import suppress
from pathlib import Path
from struct import Struct
from typing import TYPE_CHECKING

from mcap.writer import CompressionType, Writer

from recordings import foxglove
from recordings.descriptors import descriptor_set
from recordings.errors import RecordingError
from recordings.geometry import METADATA_NAME as GEOMETRY_METADATA
from recordings.schema import (
    BLOCK_MEASURED,
    BLOCK_PREDICTED,
    CLOCK_METADATA,
    CYCLE,
    EVENT_TIME,
    EVENTS_TOPIC,
    MISSED,
    RECORDER_METADATA,
    SCENE_TOPIC,
    SCHEMA_METADATA,
    TABLE_MEASURED,
    TABLE_TARGET,
    TOPICS,
    TRANSFORMS_TOPIC,
    VERSION,
    Topic,
)

if TYPE_CHECKING:
    from collections.abc import Mapping

    from recordings.geometry import Geometry
    from twin.cycle import CycleRecord, Event, Missed

CHUNK_SIZE = 65_536
"""Bytes of a chunk before compression."""
FLUSH_INTERVAL = 0.05
"""Most time between two writes to the file, s: what a killed process loses."""
SYNC_INTERVAL = 0.1
"""Most time between two fsync, s: what a power cut loses."""
TRANSFORM_INTERVAL_NS = 20_000_000
"""Least table time between two poses, ns (50 Hz: a viewer draws no more)."""
SENSIBLE_TIME = 1e9
"""Largest time of the table's clock that is put into `publish_time`, s (30 years)."""

_RESERVED = frozenset({SCHEMA_METADATA, CLOCK_METADATA, GEOMETRY_METADATA, RECORDER_METADATA})
_UINT32, _UINT64 = 0xFFFF_FFFF, 0xFFFF_FFFF_FFFF_FFFF
_WELL_KNOWN = {
    EVENTS_TOPIC: "foxglove.Log",
    TRANSFORMS_TOPIC: "foxglove.FrameTransform",
    SCENE_TOPIC: "foxglove.SceneUpdate",
}


class _Packed:
    """One topic of ours in the file: its channel and the packing of its one layout."""

    def __init__(self, topic: Topic, channel: int) -> None:
        self.channel = channel
        self._pack = Struct(topic.struct_format).pack
        self._tags = topic.tags

    def encode(self, *values: float) -> bytes:
        return self._pack(*(part for pair in zip(self._tags, values, strict=True) for part in pair))


class RunWriter:
    """A `twin.cycle.Sink` that is a file.

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

    Raises
    ------
    RecordingError
        The file exists and `overwrite` is False, the folder cannot be written, or a metadata name is reserved.

    Notes
    -----
    Not thread-safe. `cycle`, `missed` and `event` may block on the disk and raise OSError (a full disk), so a control
    loop hands its samples to a `Recorder`, which runs this in a process of its own.
    """

    def __init__(
        self,
        path: Path,
        metadata: Mapping[str, Mapping[str, str]],
        geometry: Geometry | None = None,
        *,
        overwrite: bool = False,
    ) -> None:
        for name in _RESERVED & set(metadata):
            raise RecordingError(f"metadata name '{name}' is reserved for the recording itself")
        self.path = Path(path)
        self.written = 0
        self.safe = 0
        self._geometry = geometry
        self._origin_ns: int | None = None
        self._next_pose_ns = 0
        self._last_ns = 0
        self._events = 0
        self._flushed_at = self._synced_at = -math.inf
        if self.path.exists() and not overwrite:
            raise RecordingError(f"{self.path} exists already and is not overwritten")
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            self._file = self.path.open("wb" if overwrite else "xb")
        except OSError as error:
            raise RecordingError(f"{self.path} cannot be written: {error.strerror}") from None
        self._mcap = Writer(self._file, CHUNK_SIZE, CompressionType.LZ4, enable_data_crcs=True)
        try:
            self._begin(metadata)
        except OSError as error:
            with suppress(OSError):
                self._file.close()
            raise RecordingError(f"{self.path} cannot be written: {error.strerror}") from None

    def _begin(self, metadata: Mapping[str, Mapping[str, str]]) -> None:
        self._mcap.start(profile="", library="shake-table-twin")
        major, minor = VERSION
        self._mcap.add_metadata(SCHEMA_METADATA, {"major": str(major), "minor": str(minor)})
        if self._geometry is not None:
            self._mcap.add_metadata(GEOMETRY_METADATA, self._geometry.to_metadata())
        for name, values in metadata.items():
            self._mcap.add_metadata(name, dict(values))
        packed: dict[str, _Packed] = {}
        for topic in TOPICS:
            schema = self._mcap.register_schema(topic.schema_name, "protobuf", descriptor_set())
            units = {field.name: f"{field.unit}: {field.text}" for field in topic.fields}
            packed[topic.name] = _Packed(topic, self._mcap.register_channel(topic.name, "protobuf", schema, units))
        self._target, self._measured = packed[TABLE_TARGET.name], packed[TABLE_MEASURED.name]
        self._block, self._predicted = packed[BLOCK_MEASURED.name], packed[BLOCK_PREDICTED.name]
        self._cycle, self._missed = packed[CYCLE.name], packed[MISSED.name]
        self._event_time = packed[EVENT_TIME.name]
        schemas = {
            name: self._mcap.register_schema(name, "protobuf", data)
            for name, data in foxglove.well_known_schemas().items()
        }
        self._foxglove = {
            topic: self._mcap.register_channel(topic, "protobuf", schemas[name]) for topic, name in _WELL_KNOWN.items()
        }
        self._sync()

    def cycle(self, record: CycleRecord) -> None:
        """Write one cycle."""
        host = record.host_time_ns
        table = self._table_ns(record.time, host)
        sequence = record.cycle & _UINT32
        add = self._mcap.add_message
        add(self._target.channel, host, self._target.encode(record.target_position), table, sequence)
        add(
            self._measured.channel,
            host,
            self._measured.encode(record.position, record.acceleration, record.status),
            table,
            sequence,
        )
        add(self._block.channel, host, self._block.encode(record.rotation), table, sequence)
        add(
            self._predicted.channel,
            host,
            self._predicted.encode(record.predicted_rotation, record.predicted_angular_velocity),
            table,
            sequence,
        )
        add(self._cycle.channel, host, self._cycle.encode(record.cycle, record.time, record.lateness), table, sequence)
        self._last_ns = table
        if table >= self._next_pose_ns and self._geometry is not None:
            self._poses(record, table, self._geometry)
        self.written += 1

    def missed(self, missed: Missed) -> None:
        """Write a gap; its `publish_time` is that of the last cycle before it."""
        table = self._last_ns or missed.host_time_ns
        payload = self._missed.encode(missed.first, missed.last)
        self._mcap.add_message(self._missed.channel, missed.host_time_ns, payload, table, missed.first & _UINT32)
        self.written += 1

    def event(self, event: Event) -> None:
        """Write an event: its text as foxglove.Log, and its exact time beside it."""
        host, table = event.host_time_ns, self._table_ns(event.time, event.host_time_ns)
        text = foxglove.log_message(table, event.level, event.name, event.message)
        sequence = self._events & _UINT32
        self._mcap.add_message(self._event_time.channel, host, self._event_time.encode(event.time), table, sequence)
        self._mcap.add_message(self._foxglove[EVENTS_TOPIC], host, text, table, sequence)
        self._events += 1
        self.written += 1

    def tick(self, now: float) -> None:
        """Flush and fsync where the intervals are over; `now` is any monotonic clock, s."""
        if now - self._synced_at >= SYNC_INTERVAL:
            self._sync()
            self._flushed_at = self._synced_at = now
        elif now - self._flushed_at >= FLUSH_INTERVAL:
            self._mcap.flush()
            self._flushed_at = now

    def finish(self, metadata: Mapping[str, Mapping[str, str]] | None = None) -> None:
        """Write closing metadata (statistics, verdict), the index, and close the file; a second call does nothing."""
        if self._file.closed:
            return
        try:
            self._mcap.flush()
            for name, values in (metadata or {}).items():
                self._mcap.add_metadata(name, dict(values))
            self._mcap.finish()
            self._file.flush()
            os.fsync(self._file.fileno())
            self.safe = self.written
        finally:
            self._file.close()

    def _table_ns(self, time: float, host_ns: int) -> int:
        # Unsigned 64 bits in the file: a clock that makes no sense must not stop the recording of the rest.
        if not abs(time) <= SENSIBLE_TIME:
            return host_ns
        offset = round(time * 1e9)
        if self._origin_ns is None:
            self._origin_ns = max(host_ns - offset, 0)
            self._mcap.flush()
            self._mcap.add_metadata(CLOCK_METADATA, {"origin_ns": str(self._origin_ns)})
            if self._geometry is not None:
                scene = foxglove.scene_message(self._origin_ns, self._geometry)
                self._mcap.add_message(self._foxglove[SCENE_TOPIC], host_ns, scene, self._origin_ns, 0)
        return min(max(self._origin_ns + offset, 0), _UINT64)

    def _poses(self, record: CycleRecord, table: int, geometry: Geometry) -> None:
        channel, host, sequence = self._foxglove[TRANSFORMS_TOPIC], record.host_time_ns, record.cycle & _UINT32
        poses: list[bytes] = []
        if math.isfinite(record.position):
            poses.append(foxglove.table_transform(table, record.position))
        for frame, rotation in (
            (foxglove.BLOCK_MEASURED, record.rotation),
            (foxglove.BLOCK_PREDICTED, record.predicted_rotation),
        ):
            if math.isfinite(rotation):
                poses.append(foxglove.block_transform(table, frame, rotation, geometry))
        for pose in poses:
            self._mcap.add_message(channel, host, pose, table, sequence)
        self._next_pose_ns = table + TRANSFORM_INTERVAL_NS

    def _sync(self) -> None:
        self._mcap.flush()
        os.fsync(self._file.fileno())
        self.safe = self.written
