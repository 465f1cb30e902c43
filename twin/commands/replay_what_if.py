"""`twin replay --set`: the prediction with other parameters beside the original."""

from __future__ import annotations

import argparse
import json
import math
import sys
from dataclasses import dataclass, replace

import numpy as np

from devices.errors import DeviceError
from recordings.geometry import Geometry
from recordings.replay import check_replayable, replay
from recordings.rewrite import Contents, own_metadata, with_predicted, write_recording
from recordings.run import Cycles, Run
from recordings.what_if import Differences, Prediction, differences, prediction_of
from twin.commands.emulated_run import Kept, perform_emulated
from twin.commands.player import Player
from twin.commands.recording import live_twin
from twin.commands.scene_change import assignments, changed, moves_the_base, without_effect
from twin.cycle import Event, Missed
from twin.errors import InputError
from twin.provenance import processor, versions
from twin.rocking.track import BlockEvent
from twin.scene import Scene

ROWS = 8
"""Impacts listed on a terminal; `--json` has all."""


@dataclass(frozen=True)
class _Other:
    """What would have been: the prediction, and all that a recording of it would hold."""

    prediction: Prediction
    cycles: Cycles
    events: tuple[Event, ...]
    missed: tuple[Missed, ...]
    base: str


def what_if(options: argparse.Namespace, recorded: Run, scene: Scene, player: Player) -> int:
    """Predict with the changed scene and say what differs; 0 where it was done to the end."""
    check_replayable(recorded)
    changes = assignments(options.set)
    other_scene = changed(scene, changes)
    again = replay(recorded, live_twin(scene))
    moving = moves_the_base(changes)
    other = _emulated(other_scene, moving) if moving else _replayed(recorded, other_scene, player)
    player.clear()
    if not other.prediction.time.size:
        print("quit before the first sample: there is nothing to compare", file=sys.stderr)
        return 1
    difference = differences(prediction_of(again, recorded.cycles), other.prediction)
    if options.out is not None:
        _write(options, recorded, other_scene, other)
    notes = [] if again.agrees else ["the original prediction is not reproduced here: see twin replay without --set"]
    if idle := without_effect(changes):
        notes.append(f"{', '.join(idle)}: no prediction depends on that")
    whole = bool(moving) or len(other.prediction.time) == len(recorded.cycles)
    if options.json:
        print(json.dumps(_data(options, recorded, other, difference, notes), indent=2, allow_nan=False))
    else:
        print("\n".join(_lines(options, recorded, other, difference, notes)))
    return 0 if whole else 1


def _replayed(recorded: Run, scene: Scene, player: Player) -> _Other:
    """Predict from the recorded base motion."""
    again = replay(recorded, live_twin(scene), pace=player.pace, each=player.show)
    cycles = replace(
        recorded.cycles.between(0, again.played),
        predicted_rotation=again.predicted_rotation,
        predicted_angular_velocity=again.predicted_angular_velocity,
    )
    events = with_predicted(recorded.events, again.events, recorded.cycles)
    base = "as recorded: measured base acceleration"
    return _Other(prediction_of(again, recorded.cycles), cycles, events, recorded.missed, base)


def _emulated(scene: Scene, moving: list[str]) -> _Other:
    """Predict from the base motion of the emulated table, which performs the changed scene."""
    try:
        _, report, kept = perform_emulated(scene)
    except DeviceError as error:
        raise InputError(f"the emulated {scene.table.device}: {error}") from None
    cycles = Cycles.of(kept.cycles)
    predicted = Prediction(cycles.time, cycles.predicted_rotation, _predicted(kept))
    stopped = "" if report.tripped is None else f"; it tripped: {report.tripped}"
    base = f"of the emulated {scene.table.device}, because {', '.join(moving)} moves the base otherwise{stopped}"
    return _Other(predicted, cycles, tuple(kept.events), tuple(kept.gaps), base)


def _predicted(kept: Kept) -> tuple[BlockEvent, ...]:
    """Return the predicted block's events; an impact's rate is the one of the last cycle before it."""
    times = np.array([record.time for record in kept.cycles])
    found: list[BlockEvent] = []
    for event in kept.events:
        if event.message.startswith("predicted: "):
            row = max(int(np.searchsorted(times, event.time)) - 1, 0)
            found.append(BlockEvent(event.time, event.name, kept.cycles[row].predicted_angular_velocity))
    return tuple(found)


def _write(options: argparse.Namespace, recorded: Run, scene: Scene, other: _Other) -> None:
    metadata = own_metadata(recorded.metadata)
    metadata["scene"] = {"name": scene.name, "title": scene.title, "json": scene.model_dump_json()}
    metadata["versions"], metadata["processor"] = versions(), processor()
    metadata["what_if"] = {"of": recorded.path.name, "set": "; ".join(options.set), "base_motion": other.base}
    measured = metadata.get("result", {}).get("measured", "unknown")
    metadata["result"] = {"predicted": other.prediction.outcome, "measured": measured}
    block = scene.block.block()
    geometry = Geometry(block.width, block.height)
    write_recording(Contents(metadata, geometry, other.cycles, other.events, other.missed), options.out)


def _lines(
    options: argparse.Namespace, recorded: Run, other: _Other, difference: Differences, notes: list[str]
) -> list[str]:
    before, after = difference.before, difference.after
    lines = [f"what if    {'; '.join(options.set)} in {recorded.path}"]
    lines.append(f"base       {other.base}")
    lines.append(f"outcome    {before.outcome} -> {after.outcome}")
    lines.append(f"peak       {before.peak:.4f} -> {after.peak:.4f} rad")
    if math.isfinite(difference.rms):
        lines.append(
            f"rotation   {difference.rms:.3g} rad RMS apart, {difference.largest:.4f} rad at most "
            f"(at {difference.largest_time:.3f} s)"
        )
    one, two = before.impacts, after.impacts
    lines.append(f"impacts    {len(one)} -> {len(two)}")
    same = difference.same_impacts
    for then, now in zip(one[: min(same, ROWS)], two[: min(same, ROWS)], strict=True):
        lines.append(f"           {then.time:8.4f} s -> {now.time:8.4f} s  ({1e3 * (now.time - then.time):+.2f} ms)")
    if same > ROWS:
        lines.append(f"           ... and {same - ROWS} more (--json lists all)")
    lines += [f"note       {note}" for note in notes]
    if options.out is not None:
        lines.append(f"recording  {options.out}")
    return lines


def _data(
    options: argparse.Namespace, recorded: Run, other: _Other, difference: Differences, notes: list[str]
) -> dict[str, object]:
    def number(value: float) -> float | None:
        return value if math.isfinite(value) else None

    def side(prediction: Prediction) -> dict[str, object]:
        impacts = [{"time_s": event.time, "rate_before_rad_s": event.rate} for event in prediction.impacts]
        return {"outcome": prediction.outcome, "peak_rad": prediction.peak, "impacts": impacts}

    return {
        "file": str(recorded.path),
        "set": list(options.set),
        "base_motion": other.base,
        "before": side(difference.before),
        "after": side(difference.after),
        "rms_rad": number(difference.rms),
        "largest_difference_rad": number(difference.largest),
        "largest_difference_at_s": number(difference.largest_time),
        "same_impacts": difference.same_impacts,
        "notes": notes,
        "recording": None if options.out is None else str(options.out),
    }
