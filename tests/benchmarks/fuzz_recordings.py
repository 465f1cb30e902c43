"""Fuzz the reader of recordings: `python tests/benchmarks/fuzz_recordings.py [FILES] [SEED] [--cuts]`.

A tenth of the files that issue 6 asks for takes some minutes; the process has 1 GiB of address space beyond what it
starts with, so that a bomb that goes off is an error, not a slow machine.
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from tests.recordings.fuzzing import fuzz
from tests.recordings.mutations import FORGED, HARMLESS

ROOM = 1024 * 1024 * 1024


def _limit_memory() -> str:
    try:
        import resource
    except ImportError:
        return "no limit on memory here"
    status = Path("/proc/self/statm")
    used = int(status.read_text().split()[0]) * resource.getpagesize() if status.exists() else 4 * ROOM
    resource.setrlimit(resource.RLIMIT_AS, (used + ROOM, resource.RLIM_INFINITY))
    return f"address space limited to {(used + ROOM) / 2**20:.0f} MiB, {used / 2**20:.0f} of them in use at the start"


def _peak() -> str:
    try:
        import resource
    except ImportError:
        return "unknown"
    return f"{resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024:.0f} MB resident at most"


def main() -> None:
    """Fuzz and print what came of it."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("files", nargs="?", type=int, default=10_000)
    parser.add_argument("seed", nargs="?", type=int, default=1)
    parser.add_argument("--cuts", action="store_true", help="cut the file at random places only")
    options = parser.parse_args()
    fuzz(20, 0)
    print(_limit_memory())
    began = time.perf_counter()
    result = fuzz(options.files, options.seed, ("cut",) if options.cuts else (*HARMLESS, *FORGED))
    print("\n".join(result.lines()))
    print(f"{options.files} files in {time.perf_counter() - began:.0f} s; {_peak()}; no crash, no hang")


if __name__ == "__main__":
    main()
