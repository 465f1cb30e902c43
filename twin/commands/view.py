"""`twin view`: a recording in Rerun; in a browser; as a picture; while it is written."""

from __future__ import annotations

import argparse
import json
import math
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from devices.clock import WallClock
from recordings.errors import RecordingError
from recordings.run import Run
from twin.commands.recording import open_recording, recording_path
from twin.errors import InputError

if TYPE_CHECKING:
    from recordings.map_point import MapPicture

LOOK_INTERVAL = 0.2
"""Time between two looks at a recording that is being written, or at a viewer, s."""
VIEWER_OPTIONS = ("--hide-welcome-screen",)


def run(options: argparse.Namespace) -> int:
    """Show the recording, or write what it shows."""
    _check(options)
    try:
        return _follow(options) if options.follow else _show(options)
    except RecordingError as error:
        raise InputError(str(error)) from None


def _check(options: argparse.Namespace) -> None:
    if options.at is not None and options.png is None:
        raise InputError("--at belongs to --png")
    if options.at is not None and not math.isfinite(options.at):
        raise InputError(f"--at is {options.at}; it must be a time in s")
    if options.follow and (options.png is not None or options.out is not None or options.map is not None):
        raise InputError("--follow shows a run while it is written: it goes neither with --png, --out nor --map")


def _show(options: argparse.Namespace) -> int:
    recorded = open_recording(options.file)
    from recordings.map_point import map_with_run
    from recordings.rerun_view import gravity_in, open_viewer, to_rrd

    metadata = recorded.metadata
    picture = None if options.map is None else map_with_run(options.map, metadata, gravity_in(metadata))
    if picture is not None and picture.point is None:
        print(f"note: the run ({picture.point_text}) lies outside {options.map}", file=sys.stderr)
    if options.web:
        return _web(options, recorded, picture)
    if options.out is not None:
        to_rrd(recorded, options.out, picture)
        _say(options, recorded, f"written to {options.out}", rrd=options.out)
    elif options.png is not None:
        from recordings.view_picture import to_png

        moment = to_png(recorded, options.png, time=options.at, map_picture=picture)
        _say(options, recorded, f"at {moment:.3f} s in {options.png}", png=options.png)
    else:
        open_viewer(recorded, map_picture=picture)
        _say(options, recorded, "in a Rerun viewer on 127.0.0.1")
    return 0


def _web(options: argparse.Namespace, recorded: Run, picture: MapPicture | None) -> int:
    """Serve until Ctrl-C: the server is ours, and ends with us."""
    from recordings.rerun_view import send_run
    from recordings.viewer import end, start_web_viewer

    viewer = start_web_viewer()
    try:
        send_run(viewer.url, recorded, picture)
        _say(options, recorded, f"open {viewer.page} in a browser on this machine; Ctrl-C ends it", page=viewer.page)
        clock = WallClock()
        while viewer.process.poll() is None:
            clock.wait_until(clock.now() + LOOK_INTERVAL)
        raise RecordingError(f"the server of the viewer ended (exit code {viewer.process.returncode})")
    except KeyboardInterrupt:
        return 0
    finally:
        end(viewer)


def _follow(options: argparse.Namespace) -> int:
    """Show what is written as it comes, until the recording is closed, the viewer is, or Ctrl-C."""
    from recordings.follow import Follower
    from recordings.follow_view import follow
    from recordings.viewer import WebViewer, end, start_viewer, start_web_viewer

    clock = WallClock()
    with Follower(recording_path(options.file)) as follower:
        viewer = start_web_viewer() if options.web else start_viewer(VIEWER_OPTIONS)
        where = f"open {viewer.page} in a browser here" if isinstance(viewer, WebViewer) else "in a Rerun viewer"
        if not options.json:
            print(f"following  {follower.path}: {where}; Ctrl-C ends it", flush=True)
        try:
            shown = follow(follower, viewer, clock)
            closed = "the recording is closed" if follower.ended else "the viewer was closed"
            if options.json:
                print(json.dumps({"file": str(follower.path), "cycles": shown, "closed": follower.ended}), flush=True)
            else:
                print(f"shown      {shown} cycles; {closed}", flush=True)
            while options.web and viewer.process.poll() is None:
                clock.wait_until(clock.now() + LOOK_INTERVAL)
        except KeyboardInterrupt:
            return 0
        finally:
            # A window stays open for who looks at it; a server that nobody could end does not.
            if options.web:
                end(viewer)
    return 0


def _say(options: argparse.Namespace, recorded: Run, words: str, **made: Path | str) -> None:
    if options.json:
        said: dict[str, object] = {
            "file": str(recorded.path),
            "cycles": len(recorded.cycles),
            "complete": recorded.complete,
        }
        rrd = {"rrd": None, **{name: str(value) for name, value in made.items()}}
        print(json.dumps({**said, **rrd}), flush=True)
    else:
        print(f"{recorded.path}: {len(recorded.cycles)} cycles, {words}", flush=True)
