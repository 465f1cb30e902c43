"""`twin replay`: the recorded base motion through the live code again; what if; onto an emulator; onto a bus."""

from __future__ import annotations

import argparse
import json
import math
import sys

import numpy as np

from recordings.errors import RecordingError
from recordings.foreseen import foresight_of
from recordings.pacing import FASTEST, SLOWEST
from recordings.replay import LARGEST_DIFFERENCE, Replay, replay
from recordings.run import Run
from recordings.samples import DESCRIPTIONS, sample_names
from twin.commands.player import Player
from twin.commands.recording import live_twin, open_recording, scene_in
from twin.errors import InputError
from twin.run_report import LYING

__all__ = ["live_twin", "run", "scene_in"]


def run(options: argparse.Namespace) -> int:
    """Replay; 0 where the predictions agree with the recorded ones, or what else was asked is done."""
    _check(options)
    named = options.file is not None
    name = options.file or sample_names()[0]
    recorded = open_recording(name)
    if not named and not options.json:
        print(f"sample     {name}: {DESCRIPTIONS[name]}")
    speed = _speed(options, named=named)
    try:
        with Player(recorded, speed, quiet=options.json) as player:
            if options.to_bus is not None:
                from twin.commands.replay_onto_bus import onto_bus

                return onto_bus(options, recorded, player)
            scene = scene_in(recorded)
            if options.onto_emulator:
                from twin.commands.replay_onto_emulator import onto_emulator

                return onto_emulator(options, recorded, scene, player)
            if options.set:
                from twin.commands.replay_what_if import what_if

                return what_if(options, recorded, scene, player)
            twin = live_twin(scene, foresight_of(recorded.metadata))
            again = replay(recorded, twin, pace=player.pace, each=player.show)
    except RecordingError as error:
        raise InputError(str(error)) from None
    if options.json:
        print(json.dumps(_data(recorded, again), indent=2, allow_nan=False))
    else:
        print("\n".join(_lines(recorded, again)))
    return 0 if again.agrees else 1


def _check(options: argparse.Namespace) -> None:
    """Raise `InputError` where options do not go together."""
    speed = options.speed
    if speed is not None and not (math.isfinite(speed) and SLOWEST <= speed <= FASTEST):
        raise InputError(f"--speed is {speed}; it must be {SLOWEST:g} to {FASTEST:g} (1 is real time)")
    if options.to_bus is not None and (options.set or options.onto_emulator):
        raise InputError("--to-bus sends what was recorded: it goes neither with --set nor with --onto-emulator")
    if options.to_bus is None and (options.channel is not None or options.bus_option):
        raise InputError("--channel and --bus-option belong to --to-bus")
    if options.out is not None:
        if not (options.set or options.onto_emulator):
            raise InputError("--out belongs to --set or --onto-emulator: a plain replay changes nothing")
        if options.out.suffix.lower() != ".mcap":
            raise InputError(f"--out {options.out}: a recording ends in .mcap")


def _speed(options: argparse.Namespace, *, named: bool) -> float | None:
    """Return the speed asked for; real time on a bus, and where somebody watches a sample."""
    if options.speed is not None:
        return options.speed
    watched = not named and not options.json and not options.set and sys.stderr.isatty()
    return 1.0 if options.to_bus is not None or watched else None


def _checked(again: Replay) -> str:
    if again.bits_checked:
        said = (
            "identical to the recorded ones, bit for bit" if again.identical else "NOT identical to the recorded ones"
        )
        return f"{said} (same versions and processor)"
    close = "within" if again.agrees else "NOT within"
    why = f"not compared bit for bit: {'; '.join(again.differs)}"
    return f"{close} {LARGEST_DIFFERENCE:g} rad of the recorded ones ({why})"


def _lines(recorded: Run, again: Replay) -> list[str]:
    whole = again.played == len(recorded.cycles)
    played = f"{again.played} cycles" if whole else f"{again.played} of {len(recorded.cycles)} cycles"
    lines = [f"replayed   {recorded.path}: {played}"]
    lines.append(f"checked    predictions {_checked(again)}; largest change {again.largest_change:.3g} rad")
    if not again.agrees:
        lines.append(f"changed    {_changed(recorded, again)}")
    lines.append(f"predicted  peak {again.predicted_peak:.4f} rad")
    if not math.isnan(again.measured_peak):
        lines.append(
            f"measured   peak {again.measured_peak:.4f} rad, largest difference {again.largest_difference:.4f} rad"
        )
    return lines


def _changed(recorded: Run, again: Replay) -> str:
    """Return what a twin that has changed predicts otherwise: where, by how much, and what that does to the outcome."""
    then = recorded.cycles.predicted_rotation[: again.played]
    row = int(np.searchsorted(recorded.cycles.time, again.largest_change_time))
    peak = float(np.max(np.nan_to_num(np.abs(then)), initial=0.0))
    outcomes = [
        "overturned" if size >= LYING else "rocked" if size > 0.0 else "stayed" for size in (peak, again.predicted_peak)
    ]
    return (
        f"most at {again.largest_change_time:.3f} s: {then[row]:+.6f} rad then, "
        f"{again.predicted_rotation[row]:+.6f} rad now; {outcomes[0]} with a peak of {peak:.6f} rad then, "
        f"{outcomes[1]} with {again.predicted_peak:.6f} rad now"
    )


def _data(recorded: Run, again: Replay) -> dict[str, object]:
    def number(value: float) -> float | None:
        return value if math.isfinite(value) else None

    return {
        "file": str(recorded.path),
        "complete": recorded.complete,
        "cycles": len(recorded.cycles),
        "played": again.played,
        "agrees": again.agrees,
        "checked": "bits" if again.bits_checked else f"{LARGEST_DIFFERENCE:g} rad",
        "identical": again.identical,
        "differs": again.differs,
        "largest_change_rad": number(again.largest_change),
        "largest_change_at_s": number(again.largest_change_time),
        "predicted_peak_rad": number(again.predicted_peak),
        "measured_peak_rad": number(again.measured_peak),
        "largest_difference_rad": number(again.largest_difference),
    }
