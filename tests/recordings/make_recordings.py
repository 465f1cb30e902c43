"""Make the recordings that ship (recordings/samples) and the references of the regression test (tests/recordings/data).

    python -m tests.recordings.make_recordings

Each is a scene performed on its emulated table on a manual clock: the same code gives the same signals, bit for bit,
and the host's clock is made up (it begins with 2026). To be run where the schema, the devices or the twin change on
purpose; `tests/recordings/test_references.py` says when the old references no longer give the old predictions.
"""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path

from recordings.geometry import Geometry
from recordings.rewrite import Contents, write_recording
from recordings.run import Cycles
from recordings.samples import DESCRIPTIONS, sample_path
from twin.commands.emulated_run import perform_emulated, virtual_options
from twin.commands.run_words import opening
from twin.scene import Scene, parse_scene

START_NS = 1_767_225_600_000_000_000
"""2026-01-01 00:00:00 UTC."""
DATA = Path(__file__).parent / "data"

SCENE = """
title = "{title}"
[block]
width_mm = 60
height_mm = 270
mass_kg = 2.5692
{block}
[excitation]
{excitation}
[table]
device = "quanser_st3"
settle_s = 0.1
[twin]
cycle_hz = 250
"""
SAMPLES = {
    "sine": ("", 'kind = "sine"\namplitude_g = 0.32\nfrequency_hz = 5.0'),
    "free": ("initial_rotation_deg = 6", 'kind = "none"\nduration_s = 3.5'),
    "fall": ("", 'kind = "sine"\namplitude_g = 0.45\nfrequency_hz = 3.0'),
}
"""Of each sample what stands in its scene's [block] and [excitation]."""
REFERENCES = {
    "sine": ("restitution = 0.6", 'kind = "sine"\namplitude_g = 0.30\nfrequency_hz = 4.0'),
    "free": ("restitution = 0.8\ninitial_rotation_deg = -8", 'kind = "none"\nduration_s = 1.6'),
    "constant": ("restitution = 0.5", 'kind = "constant"\nacceleration_g = 0.35\nduration_s = 0.08'),
}
"""The same of the references: their blocks come to rest soon, and their files stay below 100 kB."""
REFERENCE_CYCLES = 320
"""A reference ends with this cycle, in the middle of the run: the twin is driven by what was measured up to then."""


def scene_of(name: str, title: str, block: str, excitation: str) -> Scene:
    """Return one of the scenes above."""
    return parse_scene(SCENE.format(title=title, block=block, excitation=excitation), name=name, folder=Path())


def contents_of(scene: Scene) -> Contents:
    """Perform a scene and return what its recording holds."""
    rehearsal, report, kept = perform_emulated(scene)

    def host(time: float) -> int:
        return START_NS + round(time * 1e9)

    options = virtual_options()
    options.operator, options.note = None, "made by tests/recordings/make_recordings.py on a manual clock"
    metadata = opening(scene, rehearsal, options)
    metadata["result"] = {
        "tripped": report.tripped or "",
        "predicted": report.predicted_outcome,
        "measured": report.measured_outcome,
        "executed": str(report.executed),
        "missed": str(report.missed),
    }
    cycles = Cycles.of([replace(record, host_time_ns=host(record.time)) for record in kept.cycles])
    events = tuple(replace(event, host_time_ns=host(event.time)) for event in kept.events)
    return Contents(metadata, Geometry(rehearsal.block.width, rehearsal.block.height), cycles, events, ())


def cut(contents: Contents, count: int) -> Contents:
    """Return the beginning of a run: `count` cycles, and what happened during them."""
    cycles = contents.cycles.between(0, count)
    events = tuple(event for event in contents.events if event.host_time_ns <= cycles.host_time_ns[-1])
    return replace(contents, cycles=cycles, events=events)


def main() -> None:
    """Write all of them, replacing the old ones."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.parse_args()
    wanted = [(sample_path(name), scene_of(name, DESCRIPTIONS[name], *tables)) for name, tables in SAMPLES.items()] + [
        (DATA / f"reference_{name}.mcap", scene_of(name, f"reference: {name}", *tables))
        for name, tables in REFERENCES.items()
    ]
    for path, scene in wanted:
        path.unlink(missing_ok=True)
        contents = contents_of(scene)
        if path.parent == DATA:
            contents = cut(contents, REFERENCE_CYCLES)
        write_recording(contents, path)
        result = contents.metadata["result"]
        print(f"{path}: {len(contents.cycles)} cycles, {path.stat().st_size / 1000:.0f} kB, {result}")  # noqa: T201


if __name__ == "__main__":
    main()
