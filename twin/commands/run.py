"""`twin run`: a scene performed live and recorded."""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Callable
from contextlib import ExitStack, nullcontext
from datetime import UTC, datetime
from pathlib import Path

from devices.clock import SPIN_IN_REAL_TIME, ManualClock, WallClock
from devices.errors import DeviceError
from devices.positioning import bring_to, distance_to
from devices.scheduling import undisturbed
from recordings.can_traffic import CanTap
from recordings.errors import RecordingError
from recordings.foreseen import FORESIGHT_METADATA, foresight_metadata
from recordings.geometry import Geometry
from recordings.live_view import LiveView
from recordings.recorder import Recorder
from twin.campaign import is_campaign
from twin.commands.arming import check_arming, confirm, dry_run, outlives, staged
from twin.commands.campaign_run import Performed, run_campaign
from twin.commands.connection import EMULATOR, Connection, connect, device_for
from twin.commands.emulator_words import emulator_data, emulator_lines
from twin.commands.injection import with_asked_faults
from twin.commands.inputs import capacity_for, emulator_numbers
from twin.commands.latch import latch, operator_name, reset
from twin.commands.operator import interruptible
from twin.commands.outlook import stoppable_until, table_loop, twin_of_run
from twin.commands.progress import Progress, compiling
from twin.commands.run_metadata import node_answers
from twin.commands.run_words import after, as_data, before, closing, opening
from twin.commands.tuned_run import TunedRun, reproduced, tuned_run
from twin.cycle import Event, Sink, Tee
from twin.errors import InputError
from twin.forecast.forecast import warm_up as warm_up_forecast
from twin.live import perform
from twin.live_loop import Ends, Watch
from twin.rehearsal import Rehearsal, rehearse
from twin.rocking.track import warm_up
from twin.run_report import RunReport
from twin.scene import Scene
from twin.stopping import stop_deceleration
from twin.tuning.play import Measured
from twin.tuning.report import errors_line, reproduction_data


def run(options: argparse.Namespace) -> int:
    """Perform the scene, or a campaign; 0 performed and recorded, 1 tripped or not recorded whole."""
    if is_campaign(options.scene):
        return run_campaign(options, perform_scene)
    if options.yes or options.restart:
        raise InputError(f"--{'yes' if options.yes else 'restart'} belongs to a campaign, which {options.scene} is not")
    performed = perform_scene(options, staged(options), None)
    if options.json and performed.said is not None:
        print(json.dumps(performed.said, indent=2, allow_nan=False))
    return performed.code


def perform_scene(options: argparse.Namespace, asked: Scene, path: Path | None) -> Performed:
    """Perform one scene and record it into `path`, or `--out`, or ./runs; with `--json` the caller says what it was."""
    elsewhere = options.device == EMULATOR and options.bus != "virtual"
    scene = with_asked_faults(asked, options, "host" if elsewhere else None)
    entry = device_for(options, scene)
    check_arming(options, entry)
    capacity = capacity_for(scene)
    place: Path = path or options.out or Path("runs") / f"{scene.name}-{datetime.now(UTC):%Y%m%dT%H%M%S}.mcap"
    if place.suffix.lower() != ".mcap":
        raise InputError(f"--out {place}: a recording ends in .mcap")
    with compiling(quiet=options.json):
        rehearsal = rehearse(scene, capacity)
        warm_up()
        warm_up_forecast()
    tuned = tuned_run(options, entry, rehearsal)
    numbers = emulator_numbers(scene) if options.device == EMULATOR else None
    # What is about to happen is read before it is agreed to.
    expected = "\n".join([*before(scene, rehearsal), *emulator_lines(numbers, scene, capacity), *tuned.lines])
    print(expected, file=sys.stderr if options.json else sys.stdout, flush=True)
    if dry_run(entry, options):
        return Performed(0)
    confirm(entry, options)
    acknowledged = reset(entry.name, options.operator or operator_name()) if options.reset else None
    metadata = {**opening(scene, rehearsal, options), "tuned": tuned.data, "emulator": emulator_data(numbers)}
    geometry = Geometry(rehearsal.block.width, rehearsal.block.height)
    try:
        with ExitStack() as stack:
            clock = ManualClock() if options.fast else None
            link = stack.enter_context(connect(options, scene, entry, capacity, clock=clock))
            metadata["device_answers"] = node_answers(link.table)
            if scene.twin.forecast:
                loop = table_loop(scene, tuned=tuned.targets is not None)
                metadata[FORESIGHT_METADATA] = foresight_metadata(
                    loop, capacity.stroke, capacity.acceleration, stoppable_until(rehearsal)
                )
            recorder = Recorder(place, metadata, geometry)
            stack.callback(recorder.finish)
            if options.can_traffic and link.bus is not None:
                link.bus.tap = CanTap(recorder)
            measured = Measured()
            sink: Sink = Tee(recorder, measured)
            if options.view:
                viewer = LiveView(metadata, geometry)
                stack.callback(_end_view, viewer)
                sink = Tee(recorder, measured, viewer)
            if acknowledged is not None:
                print(f"reset      {acknowledged}", file=sys.stderr)
                sink.event(Event(0.0, time.time_ns(), "warning", "reset", acknowledged))
            report = _perform(options, scene, rehearsal, tuned, link, sink, lambda: _recorder_trouble(recorder))
            achieved = reproduced(rehearsal, measured) if report.tripped is None else None
            end = closing(report, link)
            if achieved is not None:
                end["reproduction"] = {name: str(value) for name, value in reproduction_data(achieved).items()}
            written = recorder.finish(end)
    except RecordingError as error:
        raise InputError(str(error)) from None
    except DeviceError as error:
        raise InputError(f"{scene.table.device}: {error}") from None
    if report.tripped is not None and outlives(options):
        latch(entry.name, report.tripped, place)
    if not options.json:
        lines = after(report, written)
        if achieved is not None:
            lines.append(f"table      {errors_line(achieved)}")
        print("\n".join(lines), flush=True)
    rrd = _rrd(place) if (not options.fast if options.rrd is None else options.rrd) else None
    if rrd is not None and not options.json:
        print(f"rerun      {rrd}")
    said = {**as_data(scene, report, written, rrd), "tuned": tuned.data}
    said["reproduction"] = None if achieved is None else reproduction_data(achieved)
    return Performed(0 if report.tripped is None and written.complete else 1, report, place, said)


def _perform(
    options: argparse.Namespace,
    scene: Scene,
    rehearsal: Rehearsal,
    tuned: TunedRun,
    link: Connection,
    sink: Sink,
    trouble: Callable[[], Ends | None],
) -> RunReport:
    report = RunReport()
    clock = link.faults.clock
    with interruptible() as operator:
        try:
            with link.table as table:
                tuned.check(table)
                if options.reset:
                    table.reset_fault()
                start = rehearsal.motion.displacement(0.0)
                if distance_to(table, start):
                    print(f"moving     from {table.position * 1e3:.1f} mm to the start of the run", file=sys.stderr)
                gentle = stop_deceleration(scene, rehearsal.capacity)
                if not bring_to(table, start, gentle, link.clock, stopped=lambda: operator.stopped() is not None):
                    report.tripped = operator.words()
                    return report
                length = rehearsal.motion.duration + rehearsal.after
                # Whatever takes time comes before the power: an enabled drive misses its host within half a second.
                twin = twin_of_run(rehearsal, tuned=tuned.targets is not None)
                targets = link.faults.targets(rehearsal, tuned.targets)
                link.faults.announce(sink)
                with (
                    Progress(length, quiet=options.json) as progress,
                    nullcontext("simulated time") if options.fast else undisturbed() as scheduling,
                ):
                    watch = Watch(
                        stopped=lambda: operator.stopped() or trouble() or link.faults.stopped(),
                        cut=operator.cut,
                        release=link.release,
                        progress=progress.show,
                    )
                    if isinstance(clock, WallClock) and scheduling.startswith("SCHED_FIFO"):
                        clock.spin = SPIN_IN_REAL_TIME
                    table.enable(start)
                    report = perform(
                        table,
                        rehearsal.motion,
                        twin,
                        sink,
                        clock,
                        trips=scene.trips,
                        after=rehearsal.after,
                        targets=targets,
                        watch=watch,
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


def _recorder_trouble(recorder: Recorder) -> Ends | None:
    """Return why a run must not go on unrecorded; None while it is recorded."""
    return None if recorder.alive else Ends("recorder", recorder.failure or "it is gone")


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
