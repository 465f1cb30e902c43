"""`twin run`: a scene performed live and recorded."""

from __future__ import annotations

import argparse
import json
import math
import signal
import sys
from collections.abc import Callable, Generator
from contextlib import ExitStack, contextmanager
from datetime import UTC, datetime
from pathlib import Path

from devices.clock import WallClock
from devices.errors import DeviceError
from devices.scheduling import real_time
from recordings.errors import RecordingError
from recordings.geometry import Geometry
from recordings.live_view import LiveView
from recordings.recorder import Recorder, RecorderReport
from twin.commands.connection import Connection, connect, device_for
from twin.commands.inputs import capacity_for, scene_of
from twin.commands.progress import Progress, compiling
from twin.commands.replay import live_twin
from twin.cycle import Sink, Tee
from twin.errors import InputError
from twin.live import perform
from twin.plan import Rehearsal, rehearse
from twin.plan_report import clip_lines
from twin.provenance import processor, versions
from twin.rocking.track import warm_up
from twin.run_report import RunReport
from twin.scene import Scene


def run(options: argparse.Namespace) -> int:
    """Perform the scene; 0 performed, 1 tripped."""
    scene = scene_of(options)
    entry = device_for(options, scene)
    capacity = capacity_for(scene)
    with compiling(quiet=options.json):
        rehearsal = rehearse(scene, capacity)
        warm_up()
    path = options.out or Path("runs") / f"{scene.name}-{datetime.now(UTC):%Y%m%dT%H%M%S}.mcap"
    metadata = _metadata(scene, rehearsal, options)
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
            _tell(options, _before(scene, rehearsal))
            report = _perform(options, scene, rehearsal, link, sink)
            written = recorder.finish(_closing(report, link))
    except RecordingError as error:
        raise InputError(str(error)) from None
    except DeviceError as error:
        raise InputError(f"{scene.table.device}: {error}") from None
    rrd = None if options.no_rrd else _rrd(path)
    if options.json:
        print(json.dumps(_data(scene, report, written, rrd), indent=2, allow_nan=False))
    else:
        print("\n".join(_after(report, written, rrd)))
    return 0 if report.tripped is None else 1


def _perform(
    options: argparse.Namespace, scene: Scene, rehearsal: Rehearsal, link: Connection, sink: Sink
) -> RunReport:
    with link.table as table, _interruptible() as stopped:
        table.enable(rehearsal.motion.displacement(0.0))
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
                stopped=stopped,
                progress=progress.show,
            )
        report.scheduling = scheduling
        if report.tripped is None:
            table.disable()
        return report


@contextmanager
def _interruptible() -> Generator[Callable[[], bool]]:
    """Turn Ctrl-C into a controlled stop: the cycle asks, and is never broken off in its middle."""
    asked = False

    def ask(*_: object) -> None:
        nonlocal asked
        asked = True

    before = signal.signal(signal.SIGINT, ask)
    try:
        yield lambda: asked
    finally:
        signal.signal(signal.SIGINT, before)


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


def _metadata(scene: Scene, rehearsal: Rehearsal, options: argparse.Namespace) -> dict[str, dict[str, str]]:
    capacity = rehearsal.capacity
    clip = {} if rehearsal.clipped is None else {"report": "\n".join(clip_lines(rehearsal.clipped))}
    numbers = capacity.model_dump(mode="json", exclude={"provenance"}, exclude_none=True)
    return {
        "scene": {"name": scene.name, "title": scene.title, "json": scene.model_dump_json()},
        "clip": clip,
        "capacity": {name: str(value) for name, value in numbers.items()},
        "capacity_provenance": dict(capacity.provenance),
        "device": {"name": scene.table.device, "driver": options.device, "bus": options.bus},
        "versions": versions(),
        "processor": processor(),
    }


def _closing(report: RunReport, link: Connection) -> dict[str, dict[str, str]]:
    timing = {name: str(value) for name, value in report.timing.percentiles().items()}
    return {
        "result": {
            "tripped": report.tripped or "",
            "predicted": report.predicted_outcome,
            "measured": report.measured_outcome,
            "executed": str(report.executed),
            "missed": str(report.missed),
            "scheduling": report.scheduling,
            "frames": link.frames(),
        },
        "timing": timing,
    }


def _tell(options: argparse.Namespace, lines: list[str]) -> None:
    if not options.json:
        print("\n".join(lines), flush=True)


def _before(scene: Scene, rehearsal: Rehearsal) -> list[str]:
    lines = [f"scene      {scene.name}: {scene.title}"]
    if rehearsal.clipped is not None:
        lines += clip_lines(rehearsal.clipped)
    length = rehearsal.motion.duration + rehearsal.after
    lines.append(f"run        {length:.1f} s at {scene.twin.cycle_hz:g} Hz on {scene.table.device}")
    return lines


def _after(report: RunReport, written: RecorderReport, rrd: Path | None) -> list[str]:
    t = report.timing.percentiles()
    late = (
        f"{t['lateness_p50_us']:.0f} us (median), {t['lateness_p99_us']:.0f} (99 %), "
        f"{t['lateness_p999_us']:.0f} (99.9 %), {t['lateness_max_us']:.0f} (most)"
    )
    lines = [
        f"outcome    {report.predicted_outcome} predicted, {report.measured_outcome} measured",
        f"peak       {report.predicted_peak:.4f} rad predicted, {report.measured_peak:.4f} rad measured; "
        f"largest difference {report.largest_difference:.4f} rad",
        f"cycles     {report.executed} executed, {report.missed} missed (overruns)",
        f"timing     late by {late}; work {t['work_p50_us']:.0f} us (median), {t['work_p99_us']:.0f} (99 %); "
        f"{report.scheduling}",
        f"recording  {written.path}" + ("" if written.complete else f" INCOMPLETE: {_incomplete(written)}"),
    ]
    if rrd is not None:
        lines.append(f"rerun      {rrd}")
    if report.tripped is not None:
        lines.insert(0, f"TRIPPED    {report.tripped}")
    return lines


def _incomplete(written: RecorderReport) -> str:
    return written.failure or f"{written.dropped} dropped, {written.lost} lost, {written.refused} refused"


def _data(scene: Scene, report: RunReport, written: RecorderReport, rrd: Path | None) -> dict[str, object]:
    def number(value: float) -> float | None:
        return value if math.isfinite(value) else None

    return {
        "scene": scene.name,
        "tripped": report.tripped,
        "predicted": {"outcome": report.predicted_outcome, "peak_rotation_rad": report.predicted_peak},
        "measured": {"outcome": report.measured_outcome, "peak_rotation_rad": number(report.measured_peak)},
        "largest_difference_rad": number(report.largest_difference),
        "cycles": {"executed": report.executed, "missed": report.missed, **report.timing.percentiles()},
        "scheduling": report.scheduling,
        "recording": str(written.path),
        "recording_complete": written.complete,
        "rrd": None if rrd is None else str(rrd),
    }
