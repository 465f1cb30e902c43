"""Read a long recording and say what it costs: `python tests/benchmarks/read_recording.py [SECONDS]`, at 1 kHz.

The file is written first; each way of reading then runs in a process of its own, so that its memory is its own.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from recordings import Geometry, RunWriter, cycle_blocks, read_run
from twin.cycle import CycleRecord

START_NS = 1_760_000_000_000_000_000
NOISY = (0.02, 0.02, 1.0, 0.15, 0.15, 0.7)


def write(path: Path, seconds: float) -> None:
    """Write a run of noise: nothing in it compresses by chance."""
    rng = np.random.default_rng(1)
    count = round(seconds * 1000)
    writer = RunWriter(path, {"scene": {"name": "long"}}, Geometry(0.06, 0.27))
    for first in range(0, count, 10_000):
        block = rng.normal(size=(min(10_000, count - first), len(NOISY))) * NOISY
        for k, values in enumerate(block.tolist(), start=first):
            time_s = k * 1e-3
            writer.cycle(CycleRecord(k, time_s, START_NS + k * 1_000_000, 1e-5, *values, 0x1237))
            writer.tick(time_s)
    writer.finish()


def read(path: Path, way: str) -> str:
    """Read in one way and say what it cost."""
    began = time.perf_counter()
    count = len(read_run(path).cycles) if way == "read_run" else sum(len(block) for block in cycle_blocks(path))
    took = time.perf_counter() - began
    try:
        import resource
    except ImportError:
        peak = "unknown memory"
    else:
        peak = f"{resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024:.0f} MB resident at most"
    return f"{way:13} {count} cycles in {took:.2f} s, {peak}"


def main() -> None:
    """Write, read and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("seconds", nargs="?", type=float, default=600.0)
    parser.add_argument("--read", nargs=2, metavar=("FILE", "WAY"))
    options = parser.parse_args()
    if options.read:
        print(read(Path(options.read[0]), options.read[1]))
        return
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "long.mcap"
        write(path, options.seconds)
        print(f"{options.seconds:g} s at 1 kHz: {path.stat().st_size / 1e6:.1f} MB")
        for way in ("read_run", "cycle_blocks"):
            subprocess.run([sys.executable, __file__, "--read", str(path), way], check=True, timeout=600)


if __name__ == "__main__":
    main()
