"""`twin run`: a scene performed live and recorded."""

from __future__ import annotations

import argparse
import json
import signal
import sys
from collections.abc import Callable, Generator
from contextlib import ExitStack, contextmanager
from datetime import UTC, datetime
from pathlib import Path

from devices.clock import WallClock
from devices.errors import DeviceError
from devices.positioning import bring_to, distance_to
from devices.scheduling import real_time
from recordings.errors import RecordingError
from recordings.geometry import Geometry
from recordings.live_view import LiveView
from recordings.recorder import Recorder
from twin.commands.connection import Connection, confirm, connect, device_for
from twin.commands.inputs import capacity_for, scene_of
from twin.commands.progress import Progress, compiling
from twin.commands.replay import live_twin
from twin.commands.run_words import after, as_data, before, closing, opening
from twin.cycle import Sink, Tee
from twin.errors import InputError
from twin.live import perform
from twin.rehearsal import Rehearsal, rehearse
from twin.rocking.track import warm_up
from twin.run_report import RunReport
from twin.scene import Scene
from twin.stopping import stop_deceleration

STOP_SIGNALS = ("SIGINT", "SIGTERM", "SIGHUP", "SIGBREAK")
"""Ctrl-C, a polite kill, a closed terminal (POSIX, Windows): each is a controlled stop while the table is ours."""


def run(options: argparse.Namespace) -> int:
    """Perform the scene; 0 performed and recorded, 1 tripped or not recorded whole."""
    scene = scene_of(options)
    entry = device_for(options, scene)
    capacity = capacity_for(scene)
    path = options.out or Path("runs") / f"{scene.name}-{datetime.now(UTC):%Y%m%dT%H%M%S}.mcap"
    if path.suffix.lower() != ".mcap":
        raise InputError(f"--out {path}: a recording ends in .mcap")
    with compiling(quiet=options.json):
        rehearsal = rehearse(scene, capacity)
        warm_up()
    # What is about to happen is read before it is agreed to.
    print("\n".join(before(scene, rehearsal)), file=sys.stderr if options.json else sys.stdout, flush=True)
    confirm(entry, options)
    metadata = opening(scene, rehearsal, options)
    geometry = Geometry(rehearsal.block.width, rehearsal.block.height)
    try:
        with ExitStack() as stack:
            link = stack.enter_context(connect(options, scene, entry, capacity))
            recorder = Recorder(path, metadata, geometry)
            stack.callback(recorder.finish)
            sink: Sink = recorder
            if options.view:
                viewer = LiveView(metadata, geometry)
                stack.callback(_end_view, viewer)
                sink = Tee(recorder, viewer)
            report = _perform(options, scene, rehearsal, link, sink, lambda: _recorder_trouble(recorder))
            written = recorder.finish(closing(report, link))
    except RecordingError as error:
        raise InputError(str(error)) from None
    except DeviceError as error:
        raise InputError(f"{scene.table.device}: {error}") from None
    if not options.json:
        print("\n".join(after(report, written)), flush=True)
    rrd = None if options.no_rrd else _rrd(path)
    if options.json:
        print(json.dumps(as_data(scene, report, written, rrd), indent=2, allow_nan=False))
    elif rrd is not None:
        print(f"rerun      {rrd}")
    return 0 if report.tripped is None and written.complete else 1


def _perform(
    options: argparse.Namespace,
    scene: Scene,
    rehearsal: Rehearsal,
    link: Connection,
    sink: Sink,
    trouble: Callable[[], str | None],
) -> RunReport:
    report = RunReport()
    with _interruptible() as interrupted:
        try:
            with link.table as table:
                if options.reset:
                    table.reset_fault()
                start = rehearsal.motion.displacement(0.0)
                if distance_to(table, start):
                    print(f"moving     from {table.position * 1e3:.1f} mm to the start of the run", file=sys.stderr)
                gentle = stop_deceleration(scene, rehearsal.capacity)
                if not bring_to(table, start, gentle, WallClock(), stopped=lambda: interrupted() is not None):
                    report.tripped = interrupted() or "operator: stop was asked"
                    return report
                table.enable(start)
                length = rehearsal.motion.duration + rehearsal.after
                with Progress(length, quiet=options.json) as progress, real_time() as scheduling:
                    report = perform(
                        table,
                        rehearsal.motion,
                        live_twin(scene),
                        sink,
                        WallClock(),
                        following_error=scene.twin.following_error_mm / 1e3,
                        after=rehearsal.after,
                        release=link.release,
                        stopped=lambda: interrupted() or trouble(),
                        progress=progress.show,
                    )
                report.scheduling = scheduling
                if report.tripped is None:
                    table.disable()
        except DeviceError as error:
            if not report.executed:
                raise
            # The run was made and then something failed, closing the table at the latest: nothing of it may be lost.
            report.tripped = f"{report.tripped}; then {error}" if report.tripped else str(error)
    return report


@contextmanager
def _interruptible() -> Generator[Callable[[], str | None]]:
    """Turn the signals that end a program into a controlled stop: the cycle asks, and is never broken off."""
    asked: list[str] = []

    def ask(number: int, _: object) -> None:
        asked.append(f"operator: stop was asked ({signal.Signals(number).name})")

    numbers = [getattr(signal, name) for name in STOP_SIGNALS if hasattr(signal, name)]
    before = {number: signal.signal(number, ask) for number in numbers}
    try:
        yield lambda: asked[0] if asked else None
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _recorder_trouble(recorder: Recorder) -> str | None:
    """Return why a run must not go on unrecorded; None while it is recorded."""
    if recorder.alive:
        return None
    return f"recorder: {recorder.failure or 'it is gone'}"


def _end_view(viewer: LiveView) -> None:
    """Hand the rest to the viewer, which stays open; one that went away is said, and has cost the run nothing."""
    viewer.close()
    if viewer.failure is not None:
        print(f"note: {viewer.failure}", file=sys.stderr)


def _rrd(path: Path) -> Path | None:
    """Write the Rerun file beside the recording; a failure is said, and costs the run nothing."""
    from recordings.reader import read_run
    from recordings.rerun_view import to_rrd

    target = path.with_suffix(".rrd")
    try:
        to_rrd(read_run(path), target)
    except RecordingError as error:
        print(f"note: no Rerun file: {error}", file=sys.stderr)
        return None
    return target
