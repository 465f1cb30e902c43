"""`twin export`: a recording for other tools."""

from __future__ import annotations

import argparse
import json
from pathlib import Path

from recordings.errors import RecordingError
from recordings.export import export
from twin.commands.recording import open_recording
from twin.errors import InputError


def run(options: argparse.Namespace) -> int:
    """Write the files; 0 where they are written."""
    recorded = open_recording(options.file)
    path: Path = options.out or Path(f"{recorded.path.stem}.{options.to}")
    if path.suffix.lower() != f".{options.to}":
        raise InputError(f"--out {path}: a {options.to} file ends in .{options.to}")
    try:
        if options.to == "blf":
            # Imported here: nothing else in this command needs python-can.
            from recordings.can_export import export_can

            export_can(recorded, path)
            files = [path]
        else:
            files = export(recorded, path, options.to)
    except RecordingError as error:
        raise InputError(str(error)) from None
    said = {"file": str(recorded.path), "cycles": len(recorded.cycles), "complete": recorded.complete}
    if options.json:
        print(json.dumps({**said, "files": [str(file) for file in files]}))
    else:
        print(f"{recorded.path}: {len(recorded.cycles)} cycles in {', '.join(map(str, files))}")
    return 0
