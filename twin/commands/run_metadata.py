"""What a recording of a run says beside its signals, as data: excitation, seeds, notes, the cycle's histogram."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np

from devices.table import ShakeTable
from excitation import Pulse
from twin.rehearsal import Rehearsal
from twin.scene import Scene

PIECES = (
    "rows t0 s, t1 s, c0 m/s2, c1 m/s3, A m/s2, omega rad/s, psi rad; "
    "a = c0 + c1 (t - t0) + A sin(omega (t - t0) + psi) from t0 to t1"
)
"""What the numbers of a pulse's pieces are; see `excitation.pieces`."""
BINS_PER_DECADE = 5
LEAST_BIN, LARGEST_BIN = 1e-6, 1.0
"""Range of a histogram of times, s; what is outside is counted in the first and last bin."""


def excitation_metadata(rehearsal: Rehearsal) -> dict[str, str]:
    """Return the excitation asked, the one given, and the table's whole motion: parameters, and pieces to compute with.

    Numbers are written so that they read back bit for bit.
    """
    asked = None if rehearsal.clipped is None else rehearsal.clipped.asked
    given, motion = rehearsal.given, rehearsal.motion
    phases = [{"name": phase.name, "start_s": phase.start, "end_s": phase.end} for phase in motion.phases]
    return {
        "asked": json.dumps(pulse_data(asked)),
        "given": json.dumps(pulse_data(given)),
        "given_pieces": json.dumps([] if given is None else given.pieces.tolist()),
        "pieces": PIECES,
        "motion_phases": json.dumps(phases),
        "motion_pieces": json.dumps(motion.pieces.tolist()),
    }


def pulse_data(pulse: Pulse | None) -> dict[str, Any] | None:
    """Return a pulse's kind and parameters, SI units; a measured accelerogram's samples are in its pieces alone."""
    if pulse is None:
        return None
    return {
        "type": type(pulse).__name__,
        "kind": pulse.kind,
        "family": pulse.family,
        "duration_s": pulse.duration,
        "peak_acceleration_m_s2": pulse.peak_acceleration,
        "peak_velocity_m_s": pulse.peak_velocity,
        "travel_m": pulse.travel,
        "parameters": _parameters(pulse),
    }


def _parameters(pulse: Pulse) -> dict[str, Any]:
    found: dict[str, Any] = {}
    for field in fields(pulse) if is_dataclass(pulse) else ():
        value = getattr(pulse, field.name)
        if isinstance(value, Pulse):
            found[field.name] = pulse_data(value)
        elif value is None or isinstance(value, bool | int | float | str):
            found[field.name] = value
    return found


def seeds(scene: Scene) -> dict[str, str]:
    """Return every seed of the run."""
    return {"emulator": str(scene.table.seed), "futures": str(scene.twin.seed)}


def notes(scene: Scene, operator: str | None, note: str | None) -> dict[str, str]:
    """Return who ran what: the operator of the command line rather than the scene's, and both their texts."""
    text = "\n".join(part for part in (scene.notes.text, note or "") if part)
    said = {"operator": operator or scene.notes.operator, "specimen": scene.notes.specimen, "text": text}
    return {name: value for name, value in said.items() if value}


def histogram(values: Sequence[float]) -> dict[str, str]:
    """Return how many times (s) fall into each bin: `edges_us`, one more than `counts`, five bins a decade.

    >>> counted = histogram([2e-5, 2.2e-5, 3.0])
    >>> sum(json.loads(counted["counts"])), len(json.loads(counted["edges_us"]))
    (3, 31)
    """
    decades = round(np.log10(LARGEST_BIN / LEAST_BIN))
    edges = np.geomspace(LEAST_BIN, LARGEST_BIN, decades * BINS_PER_DECADE + 1)
    times = np.asarray(values, dtype=np.float64)
    counts, _ = np.histogram(np.clip(times[np.isfinite(times)], LEAST_BIN, LARGEST_BIN), edges)
    return {
        "edges_us": json.dumps([float(f"{edge * 1e6:.4g}") for edge in edges]),
        "counts": json.dumps(counts.tolist()),
    }


def node_answers(table: ShakeTable) -> dict[str, str]:
    """Return what every node of an open table says of itself: name, versions, identity, state, mode."""
    said: dict[str, str] = {}
    for node in table.describe():
        identity = f"{node.vendor:X}-{node.product:X}-{node.revision:X}-{node.serial:X}"
        versions = f"hardware {node.hardware or '?'}, software {node.software or '?'}"
        mode = f", {node.mode}" if node.mode else ""
        where = node.what if node.node is None else f"node {node.node} ({node.what})"
        said[where] = f"{node.name or '?'}; {versions}; identity {identity}; {node.state}{mode}"
    return said


def answer_times(times: Mapping[str, Sequence[float]]) -> dict[str, dict[str, str]]:
    """Return a histogram record for each named series of times (s), for example "sync_to_answer"; none where empty."""
    return {f"{name}_histogram": histogram(values) for name, values in times.items() if len(values)}
