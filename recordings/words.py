"""A recording in words: what it is, its clip report and its metadata as documents, a gap as an event."""

from __future__ import annotations

import json
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Any

from twin.cycle import Event

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from twin.cycle import Missed

LONGEST_VALUE = 300
"""Characters of a value that is shown whole; a longer one is cut, and said to be."""


def about_text(metadata: Mapping[str, Mapping[str, str]], problems: Sequence[str] = ()) -> str:
    """Return what a run is and what came of it, then all its metadata, as Markdown."""
    scene = metadata.get("scene", {})
    rows = [(name, value) for name, value in _summary(metadata) if value]
    rows += [("damaged", problem) for problem in problems]
    lines = [f"# {scene.get('title') or scene.get('name') or 'A run'}", ""]
    for k, (name, value) in enumerate(rows):
        lines += [f"| {name} | {_cell(value)} |"] + (["|---|---|"] if k == 0 else [])
    return "\n".join([*lines, "", document_text(metadata)])


def clip_text(metadata: Mapping[str, Mapping[str, str]]) -> str:
    """Return what was asked of the table, what it was given, and its capacity with its provenance, as Markdown."""
    report = metadata.get("clip", {}).get("report", "")
    lines = ["# What the table was asked", "", f"```\n{report.strip() or 'nothing shook'}\n```", ""]
    capacity, provenance = metadata.get("capacity", {}), metadata.get("capacity_provenance", {})
    if capacity:
        lines += ["# Its capacity", "", "| quantity | value, SI units | where from |", "|---|---|---|"]
        lines += [
            f"| {name} | {_cell(value)} | {_cell(provenance.get(name, ''))} |" for name, value in capacity.items()
        ]
    return "\n".join(lines)


def document_text(metadata: Mapping[str, Mapping[str, str]]) -> str:
    """Return metadata as Markdown: a table for each record; values of several lines as code blocks below it."""
    lines: list[str] = []
    for name, values in metadata.items():
        lines += [f"## {name}", ""]
        short = {key: value for key, value in values.items() if "\n" not in value.strip()}
        if short:
            lines += ["| key | value |", "|---|---|"]
            lines += [f"| {key} | {_cell(value)} |" for key, value in short.items()]
            lines.append("")
        for key, value in values.items():
            if key not in short:
                lines += [f"{key}:", "", f"```\n{value.strip()}\n```", ""]
    return "\n".join(lines)


def gap_event(gap: Missed, time: float) -> Event:
    """Say a gap in words, at `time` (table's clock, s)."""
    return Event(time, gap.host_time_ns, "warning", "missed", f"cycles {gap.first} to {gap.last} were not executed")


def _summary(metadata: Mapping[str, Mapping[str, str]]) -> list[tuple[str, str]]:
    """Return the lines a reader looks for first; those the recording does not say are empty."""

    def said(record: str, *keys: str) -> str:
        values = metadata.get(record, {})
        return ", ".join(values[key] for key in keys if values.get(key))

    result = metadata.get("result", {})
    outcome = "; ".join(f"{key} {result[key]}" for key in ("predicted", "measured") if result.get(key))
    report = metadata.get("clip", {}).get("report", "")
    given = next((line.removeprefix("given").strip() for line in report.splitlines() if line.startswith("given")), "")
    asked = next((line.removeprefix("asked").strip() for line in report.splitlines() if line.startswith("asked")), "")
    return [
        ("scene", said("scene", "name")),
        ("block", _block(metadata)),
        ("asked", asked),
        ("given", given),
        ("table", said("device", "name", "driver", "bus")),
        ("outcome", outcome),
        ("tripped", said("result", "tripped")),
        ("what if", said("what_if", "set", "of")),
        ("imported", said("import", "file")),
        ("recorded", _start(metadata)),
        ("by", said("notes", "operator")),
        ("specimen", said("notes", "specimen")),
        ("notes", said("notes", "text")),
        ("version", said("versions", "shake-table-twin", "git")),
    ]


def _block(metadata: Mapping[str, Mapping[str, str]]) -> str:
    try:
        scene = json.loads(metadata.get("scene", {}).get("json", ""))
        block: dict[str, Any] = scene["block"]
        size = f"{block['width_mm']:g} x {block['height_mm']:g} mm"
        mass = f", {block['mass_kg']:g} kg" if block.get("mass_kg") else ""
        ratio = block.get("restitution")
        return f"{size}{mass}, restitution {'of Housner' if ratio is None else format(ratio, 'g')}"
    except (ValueError, KeyError, TypeError):
        return ""


def _start(metadata: Mapping[str, Mapping[str, str]]) -> str:
    text = metadata.get("clock", {}).get("origin_ns", "")
    if not text.isdecimal() or len(text) > 19:
        return ""
    return f"{datetime.fromtimestamp(int(text) // 10**9, UTC):%Y-%m-%d %H:%M:%S} UTC"


def _cell(value: str) -> str:
    """Return a value for one cell of a table: on one line, not too long, no bar that would end it."""
    text = " ".join(value.split())
    if len(text) > LONGEST_VALUE:
        text = f"{text[:LONGEST_VALUE]} ... ({len(text)} characters; `twin export` has them)"
    return text.replace("|", "\\|")
