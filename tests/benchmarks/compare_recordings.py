"""Reading and comparing ten minutes at 1 kHz: time and memory. Repeat it on a quiet machine.

    python tests/benchmarks/compare_recordings.py [MINUTES]

The run is a block that rocks all the time (a sine of 1.15 g tan(alpha), about four impacts a second), its measurement
another block's with 1 mrad of noise. Prints one line each; exit code 1 where reading and comparing took 5 s or more.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from recordings.geometry import Geometry
from recordings.rewrite import Contents, write_recording
from recordings.run import Cycles
from twin.rocking.block import Block
from twin.rocking.track import TrackedBlock

LIMIT = 5.0
MEASURE = """
import sys, time
from pathlib import Path
from recordings.reader import read_run
from recordings.compare import compare, side_of
import recordings.compare_words
begin = time.perf_counter()
run = read_run(Path(sys.argv[1]))
read = time.perf_counter() - begin
found = compare(side_of(run, "measured", "m"), side_of(run, "predicted", "p"), shift=None)
both = time.perf_counter() - begin
cpu = time.process_time()
# Not getrusage: its peak is the parent's where that is larger.
status = Path("/proc/self/status")
lines = status.read_text().splitlines() if status.exists() else []
used = next((int(line.split()[1]) / 1024 for line in lines if line.startswith("VmHWM")), float("nan"))
impacts = len(found.first.impacts), len(found.second.impacts), found.matches.first.size
print(len(run.cycles), read, both, cpu, used, *impacts)
"""


def make(path: Path, minutes: float) -> None:
    """Write the run."""
    block = Block(0.06, 0.27)
    count = int(minutes * 60_000)
    t = np.arange(count) * 1e-3
    acceleration = 1.15 * block.uplift_acceleration * np.sin(2.0 * np.pi * 3.0 * t)
    columns: list[np.ndarray] = []
    for ratio in (0.9, 0.895):
        tracked = TrackedBlock(block, ratio)
        states = np.zeros((count, 2))
        for k in range(1, count):
            tracked.advance(1e-3, float(acceleration[k - 1]), float(acceleration[k]))
            states[k] = tracked.rotation, tracked.angular_velocity
        columns.append(states)
    noise = 1e-3 * np.random.default_rng(1).standard_normal(count)
    cycles = Cycles(
        cycle=np.arange(count),
        time=t,
        host_time_ns=np.arange(count) * 1_000_000,
        lateness=np.zeros(count),
        target_position=np.zeros(count),
        position=np.zeros(count),
        acceleration=acceleration,
        rotation=columns[1][:, 0] + noise,
        predicted_rotation=columns[0][:, 0],
        predicted_angular_velocity=columns[0][:, 1],
        status=np.zeros(count, dtype=np.int64),
    )
    write_recording(Contents({}, Geometry(block.width, block.height), cycles, (), ()), path)


def main() -> int:
    """Make the run, measure, say."""
    minutes = float(sys.argv[1]) if len(sys.argv) > 1 else 10.0
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "long.mcap"
        begin = time.perf_counter()
        make(path, minutes)
        print(f"made     {path.stat().st_size / 1e6:.0f} MB in {time.perf_counter() - begin:.0f} s")
        worst = 0.0
        for _ in range(3):
            done = subprocess.run(
                [sys.executable, "-c", MEASURE, str(path)], capture_output=True, text=True, check=True
            )
            cycles, read, both, cpu, used, first, second, pairs = done.stdout.split()
            worst = max(worst, float(both))
            print(
                f"{cycles} cycles: read {float(read):.2f} s, read and compared {float(both):.2f} s "
                f"(process {float(cpu):.2f} s of CPU, {float(used):.0f} MB at most); "
                f"{first} and {second} impacts, {pairs} matched"
            )
    return 0 if worst < LIMIT else 1


if __name__ == "__main__":
    sys.exit(main())
