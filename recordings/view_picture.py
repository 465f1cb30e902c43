"""A picture of a run's Rerun window, for reports: a viewer without a window draws it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from devices.clock import WallClock
from recordings.errors import RecordingError
from recordings.rerun_blueprint import TIMELINE
from recordings.rerun_view import send_run
from recordings.viewer import end, start_viewer

if TYPE_CHECKING:
    from pathlib import Path

    from recordings.map_point import MapPicture
    from recordings.run import Run

WINDOW_SIZE = (1600, 1000)
"""Width and height of the picture, points."""
LOAD_LIMIT = 20.0
"""Most time a viewer may take to show a run, s."""
FALLING = 0.6
"""A block that falls is shown at this rotation, rad: further on there is nothing to see."""
NOTICE_TIME = 6.0
"""A new viewer covers its corner with notices about the graphics driver for so long, s."""
_POLL_INTERVAL = 0.1


def to_png(run: Run, path: Path, *, time: float | None = None, map_picture: MapPicture | None = None) -> float:
    """Draw the window of `run` at an instant and return that, s.

    Parameters
    ----------
    run : Run
    path : Path
        New file, .png.
    time : float, optional
        Table's clock, s; the instant of the largest predicted rotation unless given.
    map_picture : MapPicture, optional
        An overturning map to show too.

    Raises
    ------
    RecordingError
        The file exists or cannot be written; there is no graphics driver; the viewer did not answer.
    """
    if path.suffix.lower() != ".png":
        raise RecordingError(f"{path} is not written: the picture ends in .png")
    if path.exists():
        raise RecordingError(f"{path} exists already and is not overwritten")
    moment = _largest(run) if time is None else time
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise RecordingError(f"{path} cannot be written: {(error.strerror or str(error)).lower()}") from None
    size = "x".join(map(str, WINDOW_SIZE))
    try:
        viewer = start_viewer(("--headless", "--hide-welcome-screen", "--window-size", size))
    except RecordingError:
        raise RecordingError(
            "no picture can be drawn here: the Rerun viewer finds no graphics driver; a software one is enough "
            "(package mesa-vulkan-drivers on Debian and Ubuntu)"
        ) from None
    try:
        send_run(viewer.url, run, map_picture, panels=False)
        _shoot(viewer.url, path, moment)
    finally:
        end(viewer)
    if not path.is_file():
        raise RecordingError(f"{path} could not be written by the viewer")
    return moment


def _largest(run: Run) -> float:
    """Return when the predicted rotation is largest, s; of a block that falls, when it is on its way down."""
    if not len(run.cycles):
        return 0.0
    size = np.abs(np.nan_to_num(run.cycles.predicted_rotation))
    standing = np.where(size < FALLING, size, 0.0)
    return float(run.cycles.time[int(np.argmax(standing))])


def _shoot(url: str, path: Path, moment: float) -> None:
    from rerun.experimental import ViewerClient

    clock = WallClock()
    begun = clock.now()
    try:
        client = ViewerClient.connect(url)
        while True:
            state = client.get_state()
            if state.recordings and not state.loading:
                break
            if clock.now() - begun > LOAD_LIMIT:
                raise RecordingError(f"the viewer did not show the run within {LOAD_LIMIT:g} s")
            clock.wait_until(clock.now() + _POLL_INTERVAL)
        client.set_time(TIMELINE, duration=moment, play_state="paused")
        clock.wait_until(begun + NOTICE_TIME)
        client.save_screenshot(str(path.absolute()))
    except (RuntimeError, ConnectionError, TimeoutError) as error:
        raise RecordingError(f"the viewer did not draw the picture: {' '.join(str(error).split())[:200]}") from None
