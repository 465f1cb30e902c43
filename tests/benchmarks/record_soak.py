"""Record at a sustained rate and say what it costs: `python tests/benchmarks/record_soak.py [SECONDS] [--rate HZ]`.

Ten signals a cycle go through the `Recorder` into its own process, as in a live run. What is measured: values lost, the
recorder's CPU, bytes a message, and how long the producer's call takes. 600 s at 8 kHz make a file of 0.9 GB.
"""

from __future__ import annotations

import argparse
import math
import os
import platform
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from devices.clock import WallClock
from recordings import Recorder, cycle_blocks, read_run
from twin.cycle import CycleRecord

MESSAGES_A_CYCLE = 5


def _cpu_of(process: int) -> float:
    """Return user and system time of a process, s; NaN where the system does not tell."""
    stat = Path(f"/proc/{process}/stat")
    if not stat.exists():
        return math.nan
    fields = stat.read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def soak(path: Path, seconds: float, rate: float) -> list[str]:
    """Record, read back, and return what came of it in lines."""
    count = round(seconds * rate)
    took = np.zeros(count, dtype=np.int64)
    late = np.zeros(count)
    recorder = Recorder(path, {"scene": {"name": "soak"}}, bound=200_000)
    clock = WallClock()
    noise = np.random.default_rng(1).normal(0.0, 1e-6, (1024, 8)).tolist()
    started, cpu_before = time.time_ns(), _cpu_of(recorder._process.pid or 0)
    own_before = time.process_time()
    # Not with `real_time`: at this rate the loop never sleeps, and Linux stops such a one for 50 ms of each second.
    begin = clock.now()
    for k in range(count):
        moment = k / rate
        late[k] = clock.wait_until(begin + moment)
        sway, small = math.sin(7.0 * moment), noise[k % 1024]
        record = CycleRecord(
            k,
            moment,
            started + round(moment * 1e9),
            late[k].item(),
            0.02 * sway,
            0.02 * sway + small[0],
            -0.98 * sway + small[1],
            0.15 * sway + small[2],
            0.15 * sway + small[3],
            0.7 * sway + small[4],
            0x1237,
        )
        before = time.perf_counter_ns()
        recorder.cycle(record)
        took[k] = time.perf_counter_ns() - before
    wall = clock.now() - begin
    cpu = _cpu_of(recorder._process.pid or 0) - cpu_before
    own = time.process_time() - own_before
    report = recorder.finish(limit=60.0)
    found = sum(len(block) for block in cycle_blocks(path))
    size = path.stat().st_size
    messages = MESSAGES_A_CYCLE * count
    return [
        f"{platform.machine()}, {os.cpu_count()} cores, {platform.system()}, ordinary scheduling",
        f"{count} cycles of 10 signals in {wall:.1f} s ({count / wall:.0f} Hz), {messages} messages",
        f"lost       {count - found} cycles of the file, {report.dropped} dropped, {report.lost} lost, "
        f"{report.refused} refused; {'complete' if report.complete and read_run(path).complete else report.failure}",
        f"recorder   {cpu / wall:.1%} of a core; producer {own / wall:.1%} (its loop spins)",
        f"file       {size / 1e6:.1f} MB, {size / count:.1f} bytes a cycle, {size / messages:.1f} a message",
        f"emit       {_spread(took * 1e-9)}",
        f"late       {_spread(late)}",
    ]


def _spread(times: NDArray[np.float64]) -> str:
    us = np.percentile(times, [50, 99, 99.9, 100]) * 1e6
    return f"{us[0]:.1f} us (median), {us[1]:.1f} (99 %), {us[2]:.1f} (99.9 %), {us[3]:.1f} (most)"


def main() -> None:
    """Soak and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("seconds", nargs="?", type=float, default=20.0)
    parser.add_argument("--rate", type=float, default=8000.0)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        print("\n".join(soak(Path(folder) / "soak.mcap", options.seconds, options.rate)))


if __name__ == "__main__":
    main()
