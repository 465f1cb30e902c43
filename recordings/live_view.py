"""Show a run while it happens: a Rerun viewer fed by a process of its own, so that no viewer can hold up a cycle."""

from __future__ import annotations

import os
from functools import partial
from typing import TYPE_CHECKING

from recordings.spool import Spool

if TYPE_CHECKING:
    from collections.abc import Mapping

    from recordings.consumer import Consumer
    from recordings.geometry import Geometry


def _build(metadata: dict[str, dict[str, str]], geometry: Geometry | None, url: str | None) -> Consumer:
    # A viewer that is closed during a run is no error worth Rust's log lines; read when rerun is loaded.
    os.environ.setdefault("RUST_LOG", "off")
    # Imported here, in the feeding process: the process of the control loop never loads rerun.
    from recordings.live_feed import LiveFeed

    return LiveFeed(metadata, geometry, url)


class LiveView(Spool):
    """A `twin.cycle.Sink` that is a Rerun window.

    Parameters
    ----------
    metadata : mapping of name to mapping of str to str
        Shown as a document.
    geometry : Geometry or None
        Size of the block; without it there is no 3D.
    bound : int
        Cycles the queue holds; a viewer that falls behind by more misses the newest.
    url : str or None
        Address of a viewer that runs already, such as ``rerun+http://127.0.0.1:9876/proxy``; None starts one.

    Raises
    ------
    RecordingError
        The viewer cannot start (no display, no graphics driver).
    """

    def __init__(
        self,
        metadata: Mapping[str, Mapping[str, str]],
        geometry: Geometry | None = None,
        *,
        bound: int = 5_000,
        url: str | None = None,
    ) -> None:
        plain = {name: dict(values) for name, values in metadata.items()}
        super().__init__(partial(_build, plain, geometry, url), name="viewer", bound=bound)
