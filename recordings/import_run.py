"""Write what was imported as a recording, with the twin's prediction beside it."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from recordings.rewrite import Contents, with_predicted, write_recording
from recordings.run import Cycles
from twin.cycle import Missed

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from recordings.geometry import Geometry
    from recordings.importing import Measured
    from twin.live_twin import LiveTwin
    from twin.rocking.track import BlockEvent


def write_import(
    measured: Measured,
    twin: LiveTwin,
    path: Path,
    metadata: Mapping[str, Mapping[str, str]],
    geometry: Geometry,
    start_ns: int,
) -> Cycles:
    """Write a recording and return its cycles.

    Parameters
    ----------
    measured : Measured
    twin : LiveTwin
        Fresh; it is let go at the first sample and fed the base acceleration.
    path : Path
        New file.
    metadata : mapping
        What explains it.
    geometry : Geometry
    start_ns : int
        Stands for the host's clock at the first sample, which nobody recorded, ns since 1970.

    Raises
    ------
    RecordingError
        The file exists or cannot be written.
    """
    count = measured.cycle.size
    time = measured.cycle.astype(np.float64) * measured.step
    rotation, rate = np.empty(count), np.empty(count)
    events: list[BlockEvent] = []
    for k, (now, acceleration) in enumerate(zip(time.tolist(), measured.acceleration.tolist(), strict=True)):
        rotation[k] = twin.measure(now, acceleration)
        rate[k] = twin.block.angular_velocity
        events += twin.block.events
    unknown = np.full(count, math.nan)
    cycles = Cycles(
        cycle=measured.cycle,
        time=time,
        host_time_ns=start_ns + np.rint(time * 1e9).astype(np.int64),
        lateness=unknown,
        target_position=unknown,
        position=measured.position,
        acceleration=measured.acceleration,
        rotation=measured.rotation,
        predicted_rotation=rotation,
        predicted_angular_velocity=rate,
        status=np.zeros(count, dtype=np.int64),
    )
    places = np.flatnonzero(np.diff(measured.cycle) > 1)
    missed = tuple(
        Missed(int(measured.cycle[k]) + 1, int(measured.cycle[k + 1]) - 1, int(cycles.host_time_ns[k + 1]))
        for k in places
    )
    write_recording(Contents(metadata, geometry, cycles, with_predicted((), events, cycles), missed), path)
    return cycles
