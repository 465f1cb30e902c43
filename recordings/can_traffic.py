"""CAN frames beside the cycles: taken from a bus, and read back."""

from __future__ import annotations

from typing import TYPE_CHECKING

from recordings.schema import CAN_FRAME, DIRECTION
from twin.cycle import CanFrame

if TYPE_CHECKING:
    from collections.abc import Iterator

    from recordings.run import Run
    from twin.cycle import FrameSink

_RECEIVED, _SENT = DIRECTION.names.index("received"), DIRECTION.names.index("sent")


def frame_numbers(frame: CanFrame) -> tuple[int, int, int, int]:
    """Values of the fields of `CAN_FRAME`."""
    data = int.from_bytes(frame.data, "little")
    return frame.identifier, _SENT if frame.sent else _RECEIVED, len(frame.data), data


def frames(run: Run) -> Iterator[CanFrame]:
    """CAN frames of a recording, in the order they were recorded; none where traffic was not asked for."""
    series = run.series.get(CAN_FRAME.name)
    if series is None:
        return
    rows = zip(
        series.host_time_ns.tolist(), *(series.columns[field.name].tolist() for field in CAN_FRAME.fields), strict=True
    )
    for host, identifier, direction, length, data in rows:
        # A damaged or foreign file may say any length.
        yield CanFrame(host, identifier, data.to_bytes(8, "little")[: min(length, 8)], direction == _SENT)


class CanTap:
    """What a CAN bus calls with each frame (`CanBus.tap`); hands it on to a recorder."""

    def __init__(self, sink: FrameSink) -> None:
        self._sink = sink

    def __call__(self, time: float, identifier: int, data: bytes, sent: bool) -> None:
        """Hand on a frame that was sent or taken in at `time`, s since 1970 by the host's clock."""
        self._sink.frame(CanFrame(round(time * 1e9), identifier, data, sent))
