"""`twin tune`: the command of a pulse, corrected until the table performs it."""

from __future__ import annotations

import argparse
import json
import sys
from contextlib import nullcontext
from dataclasses import dataclass
from datetime import UTC, datetime

import numpy as np

from devices.catalogue import CatalogueEntry
from devices.clock import ManualClock
from devices.errors import DeviceError
from devices.scheduling import real_time
from devices.setpoints import first_refusal
from devices.table import ShakeTable
from excitation import Capacity, Clipped, Pulse
from excitation.table_run import TableRun
from twin.commands.arming import check_arming, confirm, dry_run
from twin.commands.connection import EMULATOR, connect, device_for
from twin.commands.inputs import capacity_for, scene_of
from twin.commands.operator import interruptible
from twin.commands.progress import compiling
from twin.commands.replay import live_twin
from twin.commands.tuned_run import identity_of, purpose_for
from twin.errors import InputError
from twin.live import set_points
from twin.plan_report import clip_lines, describe
from twin.rehearsal import clip_scene, make_motion
from twin.rocking.compiled import FloatArray
from twin.rocking.track import warm_up
from twin.scene import Scene
from twin.stopping import stop_deceleration
from twin.tuned import Errors, Purpose, TunedCommand
from twin.tuned_folder import keep
from twin.tuning.iteration import Tuning, tune
from twin.tuning.picture import check_format, draw_tuning
from twin.tuning.play import BrokenOffError, Player
from twin.tuning.report import as_data, sentences, step_line
from twin.tuning.reproduction import Reproduction
from twin.tuning.window import Window, window_of

LEAST_PAUSE = 1.0
"""Pauses beside the pulse while tuning, s: what the positioning left dies away, and the bias is read, in them."""


@dataclass(frozen=True, slots=True)
class _Task:
    """What is to be tuned: the pulse in its own run, as short as it can be, and the window in it."""

    scene: Scene
    entry: CatalogueEntry
    capacity: Capacity
    clipped: Clipped
    given: Pulse
    motion: TableRun
    window: Window
    payload: float
    purpose: Purpose

    @property
    def command(self) -> FloatArray:
        """Where to be at each sample of the run, as asked, m."""
        points = set_points(self.motion, 0.0, self.window.cycle_time)
        return np.concatenate([[self.motion.displacement(0.0)], points])


@dataclass(frozen=True, slots=True)
class _Done:
    """What the iteration came to, in how many runs, on which machine."""

    tuning: Tuning
    runs: int
    identity: str


def run(options: argparse.Namespace) -> int:
    """Tune the scene's pulse; 0 the corrected command is kept, 1 nothing is."""
    scene = scene_of(options)
    entry = device_for(options, scene)
    check_arming(options, entry)
    task = _task(options, scene, entry, capacity_for(scene))
    if options.out is not None:
        check_format(options.out)
    say = sys.stderr if options.json else sys.stdout
    print("\n".join(_before(task, options)), file=say, flush=True)
    if dry_run(entry, options):
        return 0
    confirm(entry, options)
    with compiling(quiet=options.json):
        warm_up()
    try:
        done = _tuned(options, task)
    except BrokenOffError as error:
        print(f"twin tune: nothing is kept: {error}", file=sys.stderr)
        if options.json:
            print(json.dumps({"scene": scene.name, "kept": None, "reason": str(error)}))
        return 1
    except DeviceError as error:
        raise InputError(f"{entry.name}: {error}") from None
    tuning = done.tuning
    command = _kept(task, done) if tuning.improved else None
    path = None if command is None else keep(options.tuned, command)
    if options.out is not None:
        draw_tuning(tuning, task.window, f"{scene.name}: {describe(task.given)} on {_machine(task)}", options.out)
    if options.json:
        said = {"scene": scene.name, "runs": done.runs, "kept": None if path is None else str(path), **as_data(tuning)}
        print(json.dumps(said, indent=2, allow_nan=False))
    else:
        print("\n".join(sentences(tuning, task.window)))
        print(f"kept       {path}" if path else "kept       nothing: the command as asked is no worse")
        if options.out is not None:
            print(f"picture    {options.out}")
    return 0 if path is not None else 1


def _task(options: argparse.Namespace, scene: Scene, entry: CatalogueEntry, capacity: Capacity) -> _Task:
    if capacity.machine is not None:
        raise InputError(f"{entry.name} is set by hand and released: it follows no command that could be corrected")
    if scene.fault:
        raise InputError(f"scene {scene.name}: a table with faults cannot be tuned: take [[fault]] out of it")
    if options.repeats < 2:
        raise InputError(
            f"--repeats is {options.repeats}; it must be at least 2: one run does not tell chance from error"
        )
    if options.corrections < 1:
        raise InputError(f"--corrections is {options.corrections}; it must be at least 1")
    payload = (scene.block.mass_kg or 0.0) if options.payload_kg is None else options.payload_kg
    if not 0.0 <= payload <= (capacity.payload or 1e6):
        raise InputError(f"--payload-kg is {payload:g}; it must be 0 to {capacity.payload or 1e6:g} kg")
    pulse = scene.pulse()
    if pulse is None:
        raise InputError(f"scene {scene.name}: nothing shakes: there is no pulse to tune")
    clipped = clip_scene(scene, capacity, pulse)
    if clipped.given is None:
        raise InputError(f"scene {scene.name}: {clipped.limits[0].sentence}")
    pause = max(scene.table.settle_s, LEAST_PAUSE)
    patient = scene.model_copy(update={"table": scene.table.model_copy(update={"settle_s": pause})})
    motion = make_motion(patient, capacity, clipped.given)
    cycle_time = 1.0 / scene.twin.cycle_hz
    window = window_of(motion, cycle_time, scene.table.settle_s)
    emulated = options.device == EMULATOR
    purpose = purpose_for(scene, entry, capacity, motion, emulated=emulated)
    return _Task(scene, entry, capacity, clipped, clipped.given, motion, window, payload, purpose)


def _before(task: _Task, options: argparse.Namespace) -> list[str]:
    lines = [f"scene      {task.scene.name}: {task.scene.title}", *clip_lines(task.clipped)]
    standing = f"a dead mass of {task.payload:g} kg" if task.payload else "nothing"
    if options.device == EMULATOR:
        lines.append(f"on it      {standing}, no specimen: what a table carries is part of its answer")
    else:
        lines.append(f"on it      TAKE THE SPECIMEN OFF; fix {standing} in its place: it is part of the table's answer")
    lines.append(
        f"runs       {options.repeats} of each command, {task.motion.duration:.1f} s each, up to {options.corrections} "
        f"corrections, on {_machine(task)}"
    )
    return lines


def _machine(task: _Task) -> str:
    return f"{task.entry.name} (emulated)" if task.purpose.machine == EMULATOR else task.entry.name


def _tuned(options: argparse.Namespace, task: _Task) -> _Done:
    scene, window = task.scene, task.window
    # With the emulator in this process nobody waits for a clock: it stands still and is moved.
    alone = options.device == EMULATOR and options.bus == "virtual"
    clock = ManualClock() if alone else None
    with (
        interruptible() as operator,
        connect(options, scene, task.entry, task.capacity, clock=clock, empty=True, payload=task.payload) as link,
        link.table as table,
        nullcontext() if alone else real_time(),
    ):
        identity = identity_of(table)
        player = Player(
            table,
            task.motion,
            lambda: live_twin(scene),
            link.clock,
            trips=scene.trips,
            positioning_acceleration=stop_deceleration(scene, task.capacity),
            stopped=operator.stopped,
        )
        tuning = tune(
            window,
            task.command,
            player,
            lambda command: _refused(table, command),
            repeats=options.repeats,
            most=options.corrections,
            told=lambda number, step: None if options.json else print(step_line(number, step), flush=True),
        )
        return _Done(tuning, player.runs, identity)


def _refused(table: ShakeTable, command: FloatArray) -> str | None:
    """Judge a whole command by the rule of the table and its drive, before it is played."""
    refusal = first_refusal(table.capacity, table.cycle_time, table.resolution, command[0], command[1:].tolist())
    return None if refusal is None else refusal.sentence


def _kept(task: _Task, done: _Done) -> TunedCommand:
    tuning = done.tuning
    assert tuning.verified is not None  # noqa: S101 - what was improved was verified
    return TunedCommand(
        purpose=task.purpose,
        scene=task.scene.name,
        excitation=describe(task.given),
        payload=task.payload,
        identity=done.identity,
        made=f"{datetime.now(UTC):%Y-%m-%dT%H:%M:%SZ}",
        reason=tuning.reason,
        corrections=len(tuning.steps) - 1,
        runs=done.runs,
        asked_peak=task.window.peak,
        before=_errors(tuning.before),
        after=_errors(tuning.verified),
        start=task.window.start,
        correction=tuple(tuning.correction.tolist()),
        achieved_before=tuple(tuning.before.acceleration.tolist()),
        achieved=tuple(tuning.verified.acceleration.tolist()),
    )


def _errors(r: Reproduction) -> Errors:
    return Errors(rms=r.rms, peak=r.peak, noise=r.noise)
