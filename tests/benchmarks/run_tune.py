"""How well the emulated ST-III reproduces a single sine and a single cosine, before and after `twin tune`.

Run from the project's root: `python tests/benchmarks/run_tune.py`. "Measured" is what `twin tune` says, with the noise
of accelerometer and encoder in it; "true" is the emulated table's own acceleration under the same commands, which only
an emulator can tell.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import itertools
import json
import tempfile
import time
from pathlib import Path

import numpy as np

from devices.catalogue import find_device
from devices.clock import ManualClock
from devices.quanser_st3.parameters import St3Parameters
from twin.cli import main
from twin.commands import connection
from twin.commands.replay import live_twin
from twin.commands.tuned_run import tuned_run
from twin.live import perform
from twin.live_loop import Watch
from twin.rehearsal import Rehearsal, rehearse
from twin.scene import Scene, load_scene
from twin.scene_trips import FollowingErrorTrip
from twin.tuning.play import Measured
from twin.tuning.window import window_of

QUIET = St3Parameters(accelerometer_noise=0.0, accelerometer_bias=0.0, encoder_step=0.0)
_channels = itertools.count()


def tune(scene: str, folder: Path) -> tuple[dict, float]:
    """Tune by the command itself; return what it says, and the seconds it took."""
    said = io.StringIO()
    begin = time.perf_counter()
    with contextlib.redirect_stdout(said), contextlib.redirect_stderr(io.StringIO()):
        main(["tune", scene, "--json", "--tuned", str(folder)])
    return json.loads(said.getvalue()), time.perf_counter() - begin


def true_error(scene: Scene, rehearsal: Rehearsal, targets: list[float] | None) -> tuple[float, float]:
    """Return the rms and largest error of the table's own acceleration, of the asked peak."""
    entry = find_device(scene.table.device)
    options = argparse.Namespace(bus="virtual", channel=f"truth {next(_channels)}", bus_option=[])
    clock, measured = ManualClock(), Measured()
    with connection.connect(options, scene, entry, rehearsal.capacity, clock=clock) as link, link.table as table:
        table.enable(rehearsal.motion.displacement(0.0))
        perform(
            table,
            rehearsal.motion,
            live_twin(scene),
            measured,
            clock,
            trips=scene.trips.model_copy(update={"following_error": FollowingErrorTrip(limit_mm=1e3 * 0.05)}),
            after=rehearsal.after,
            targets=targets,
            watch=Watch(release=link.release),
        )
    window = window_of(rehearsal.motion, table.cycle_time, scene.table.settle_s)
    trace = measured.trace(round(rehearsal.motion.duration / table.cycle_time))
    error = (window.acceleration - window.cut(trace.acceleration))[window.judged] / window.peak
    return float(np.sqrt(np.mean(error**2))), float(np.max(np.abs(error)))


def run() -> None:
    """Print one row a scene."""
    print("| pulse | | before: rms, largest | after: rms, largest | corrections, runs | seconds |")
    print("|---|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as folder:
        for name in ("b6l_sine", "b6l_cosine"):
            said, seconds = tune(name, Path(folder))
            before, after = said["before"], said["after"]
            scene = load_scene(name)
            entry = find_device(scene.table.device)
            rehearsal = rehearse(scene, entry.capacity)
            options = argparse.Namespace(device="emulator", tuned=Path(folder), untuned=False)
            tuned = tuned_run(options, entry, rehearsal)
            numbers, connection.emulator_numbers = connection.emulator_numbers, lambda _: QUIET
            truth = [true_error(scene, rehearsal, targets) for targets in (None, tuned.targets)]
            connection.emulator_numbers = numbers
            print(
                f"| {name} | measured | {before['rms']:.2%}, {before['peak']:.1%} | {after['rms']:.2%}, "
                f"{after['peak']:.1%} | {len(said['steps']) - 1}, {said['runs']} | {seconds:.1f} |"
            )
            print(
                f"| | without its lag | {before['rms_without_lag']:.2%} ({before['lag_s'] * 1e3:.1f} ms) | "
                f"{after['rms_without_lag']:.2%} ({after['lag_s'] * 1e3:.1f} ms) | | |"
            )
            print(f"| | noise in the rms | {before['noise']:.2%} | {after['noise']:.2%} | | |")
            print(f"| | true | {truth[0][0]:.2%}, {truth[0][1]:.1%} | {truth[1][0]:.2%}, {truth[1][1]:.1%} | | |")


if __name__ == "__main__":
    run()
