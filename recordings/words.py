"""A recording in words: its metadata as a document, a gap as an event."""

from __future__ import annotations

from typing import TYPE_CHECKING

from twin.cycle import Event

if TYPE_CHECKING:
    from collections.abc import Mapping

    from twin.cycle import Missed


def document_text(metadata: Mapping[str, Mapping[str, str]]) -> str:
    """Metadata as Markdown: a heading for each record; values of several lines as code blocks."""
    lines: list[str] = []
    for name, values in metadata.items():
        lines.append(f"## {name}")
        for key, value in values.items():
            lines.append(f"* {key}:\n```\n{value.strip()}\n```" if "\n" in value else f"* {key}: {value}")
        lines.append("")
    return "\n".join(lines)


def gap_event(gap: Missed, time: float) -> Event:
    """Say a gap in words, at `time` (table's clock, s)."""
    return Event(time, gap.host_time_ns, "warning", "missed", f"cycles {gap.first} to {gap.last} were not executed")
