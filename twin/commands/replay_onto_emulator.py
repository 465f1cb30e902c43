"""`twin replay --onto-emulator`: the recorded set-points performed by the scene's emulated table."""

from __future__ import annotations

import argparse
import json
import math
import sys

import numpy as np

from devices.clock import ManualClock
from devices.errors import DeviceError
from devices.positioning import bring_to
from recordings.replay import check_replayable
from recordings.rewrite import Contents, own_metadata, with_predicted, write_recording
from recordings.run import Run
from recordings.table_replay import SIGNALS, TableReplay, play_on_table
from twin.commands.connection import connect, emulated
from twin.commands.emulated_run import virtual_options
from twin.commands.inputs import capacity_for
from twin.commands.player import Player
from twin.commands.recording import live_twin
from twin.commands.scene_change import assignments, changed
from twin.errors import InputError
from twin.provenance import processor, versions
from twin.scene import Scene
from twin.stopping import stop_deceleration


def onto_emulator(options: argparse.Namespace, recorded: Run, scene: Scene, player: Player) -> int:
    """Perform the recorded set-points; 0 where the emulated table did all of them."""
    check_replayable(recorded)
    scene = changed(scene, assignments(options.set)) if options.set else scene
    now = _performed(recorded, scene, player)
    player.clear()
    if not len(now.cycles):
        print(f"nothing was performed: {now.ended}", file=sys.stderr)
        return 1
    if options.out is not None:
        _write(options, recorded, scene, now)
    if options.json:
        print(json.dumps(_data(recorded, now, options), indent=2, allow_nan=False))
    else:
        print("\n".join(_lines(recorded, scene, now, options)))
    return 0 if now.ended is None else 1


def _performed(recorded: Run, scene: Scene, player: Player) -> TableReplay:
    entry = emulated(scene)
    capacity = capacity_for(scene)
    start = float(recorded.cycles.position[0])
    if not math.isfinite(start):
        raise InputError(f"{recorded.path} does not say where the table began")
    try:
        with connect(virtual_options(), scene, entry, capacity) as link, link.table as table:
            bring_to(table, start, stop_deceleration(scene, capacity), ManualClock())
            table.enable(start)
            return play_on_table(
                recorded, table, live_twin(scene), release=link.release, pace=player.pace, each=player.show
            )
    except DeviceError as error:
        raise InputError(f"the emulated {scene.table.device}: {error}") from None


def _write(options: argparse.Namespace, recorded: Run, scene: Scene, now: TableReplay) -> None:
    metadata = own_metadata(recorded.metadata)
    metadata["scene"] = {"name": scene.name, "title": scene.title, "json": scene.model_dump_json()}
    metadata["device"] = {"name": scene.table.device, "driver": "emulator", "bus": "virtual"}
    metadata["versions"], metadata["processor"] = versions(), processor()
    metadata["replay"] = {
        "of": recorded.path.name,
        "onto": f"emulated {scene.table.device}",
        "set": "; ".join(options.set),
    }
    events = with_predicted(recorded.events, now.events, now.cycles)
    write_recording(Contents(metadata, recorded.geometry, now.cycles, events, recorded.missed), options.out)


def _identical(now: TableReplay, signal: str) -> bool:
    return bool(np.array_equal(getattr(now.cycles, signal), getattr(now.then, signal), equal_nan=True))


def _lines(recorded: Run, scene: Scene, now: TableReplay, options: argparse.Namespace) -> list[str]:
    lines = [f"performed  {len(now.cycles)} of {len(recorded.cycles)} cycles on the emulated {scene.table.device}"]
    if now.ended is not None:
        lines.append(f"ended      {now.ended}")
    for signal, unit in SIGNALS.items():
        rms, largest = now.apart(signal)
        if math.isnan(rms):
            said = "nothing to compare"
        elif _identical(now, signal):
            said = "as recorded, bit for bit"
        else:
            said = f"{rms:.3g} {unit} RMS, {largest:.3g} {unit} at most from the recorded one"
        lines.append(f"{signal:<11}{said}")
    if options.out is not None:
        lines.append(f"recording  {options.out}")
    return lines


def _data(recorded: Run, now: TableReplay, options: argparse.Namespace) -> dict[str, object]:
    def number(value: float) -> float | None:
        return value if math.isfinite(value) else None

    apart = {signal: [number(value) for value in now.apart(signal)] for signal in SIGNALS}
    return {
        "file": str(recorded.path),
        "cycles": len(now.cycles),
        "recorded_cycles": len(recorded.cycles),
        "ended": now.ended,
        "differences": {
            signal: {"unit": unit, "rms": apart[signal][0], "largest": apart[signal][1]}
            for signal, unit in SIGNALS.items()
        },
        "identical": {signal: _identical(now, signal) for signal in SIGNALS},
        "recording": None if options.out is None else str(options.out),
    }
