"""`twin recover`: a clean file of a damaged one, and what was lost."""

from __future__ import annotations

import argparse
import json
from dataclasses import asdict
from pathlib import Path

from recordings.errors import RecordingError
from recordings.recovery import Recovery, recover
from twin.errors import InputError


def run(options: argparse.Namespace) -> int:
    """Recover; 0 where nothing is known to be lost."""
    path: Path = options.file
    out = options.out or path.with_name(f"{path.stem}-recovered.mcap")
    if out.suffix.lower() != ".mcap":
        raise InputError(f"--out {out}: a recording ends in .mcap")
    try:
        recovery = recover(path, out)
    except RecordingError as error:
        raise InputError(str(error)) from None
    if options.json:
        print(json.dumps(_data(recovery), indent=2, allow_nan=False))
    else:
        print("\n".join(_lines(recovery)))
    return 0 if _nothing_lost(recovery) else 1


def _nothing_lost(recovery: Recovery) -> bool:
    return not (recovery.lost or recovery.cycles_lost or recovery.damaged_chunks or recovery.cut)


def _lines(recovery: Recovery) -> list[str]:
    messages = sum(recovery.written.values())
    lines = [
        f"recovered  {recovery.out}: {recovery.cycles} cycles, {recovery.duration:.3f} s, {messages} messages "
        f"of {len(recovery.written)} topics"
    ]
    lines += [f"damage     {problem}" for problem in recovery.problems]
    if recovery.cycles_lost:
        lines.append(f"lost       {recovery.cycles_lost} cycles among them, {recovery.duration_lost:.3f} s of the run")
    lines += [f"lost       {count} messages of {topic}" for topic, count in sorted(recovery.lost.items())]
    if recovery.cut:
        lines.append(
            f"lost       what came after the last cycle above: {recovery.bytes_left} bytes are in no whole record"
        )
    if not recovery.problems:
        lines.append("damage     none: the file was whole")
    elif _nothing_lost(recovery):
        lines.append("lost       nothing that was measured: only the end of the file, with its index")
    return lines


def _data(recovery: Recovery) -> dict[str, object]:
    return {
        **asdict(recovery),
        "path": str(recovery.path),
        "out": str(recovery.out),
        "nothing_lost": _nothing_lost(recovery),
    }
