"""`twin view`: a recording in Rerun."""

from __future__ import annotations

import argparse
import json
import sys

from recordings.errors import RecordingError
from recordings.reader import read_run
from twin.errors import InputError


def run(options: argparse.Namespace) -> int:
    """Open a viewer on the recording, or write a Rerun file."""
    try:
        recorded = read_run(options.file)
        for problem in recorded.problems:
            print(f"note: {options.file}: {problem}", file=sys.stderr)
        from recordings.rerun_view import open_viewer, to_rrd

        if options.out is not None:
            to_rrd(recorded, options.out)
        else:
            open_viewer(recorded)
    except RecordingError as error:
        raise InputError(str(error)) from None
    shown = {"file": str(options.file), "cycles": len(recorded.cycles), "complete": recorded.complete}
    if options.json:
        print(json.dumps({**shown, "rrd": None if options.out is None else str(options.out)}))
    else:
        where = "in a Rerun viewer on 127.0.0.1" if options.out is None else f"written to {options.out}"
        print(f"{options.file}: {len(recorded.cycles)} cycles, {where}")
    return 0
