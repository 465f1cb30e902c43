"""CAN traffic as test data: what one end of a bus sent and received, in its own order, kept as BLF."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import can

DATA = Path(__file__).parent.parent / "data"


class Frame(NamedTuple):
    """One frame; `sent` by the end that was listened at, s since 1970."""

    time: float
    identifier: int
    data: bytes
    sent: bool


def write_blf(path: Path, frames: list[Frame]) -> None:
    """Write a recording with python-can's own writer."""
    with can.BLFWriter(str(path)) as writer:
        for frame in frames:
            writer.on_message_received(
                can.Message(
                    timestamp=frame.time,
                    arbitration_id=frame.identifier,
                    data=frame.data,
                    is_extended_id=False,
                    is_rx=not frame.sent,
                )
            )


def read_blf(path: Path) -> list[Frame]:
    """Return what a recording holds."""
    with can.BLFReader(str(path)) as reader:
        return [Frame(m.timestamp, m.arbitration_id, bytes(m.data), not m.is_rx) for m in reader]
