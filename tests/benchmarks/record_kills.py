"""Kill a recording run and see what is left: `python tests/benchmarks/record_kills.py [KILLS]`.

A child process records in real time at 1 kHz through the `Recorder`; after a random time the child and its recorder
get SIGKILL at once, or the recorder alone. What is lost is the time from the last cycle in the file to the last one
that the child had handed over.
"""

from __future__ import annotations

import argparse
import mmap
import os
import random
import signal
import struct
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from devices.clock import WallClock
from recordings import Recorder, read_run
from twin.cycle import CycleRecord

PROGRESS = struct.Struct("<QQ")


def produce(path: Path, progress: Path) -> None:
    """Record until killed; the progress file says the recorder's process and the cycles handed over."""
    with progress.open("r+b") as file:
        shared = mmap.mmap(file.fileno(), PROGRESS.size)
    recorder, clock = Recorder(path, {}), WallClock()
    begin = clock.now()
    for k in range(10**9):
        clock.wait_until(begin + k * 1e-3)
        recorder.cycle(CycleRecord(k, k * 1e-3, time.time_ns(), 0.0, *[k * 1e-6] * 6, 0x1237))
        shared[:] = PROGRESS.pack(recorder._process.pid or 0, k + 1)


def kill_once(folder: Path, after: float, *, recorder_alone: bool) -> float:
    """Return what was lost, s."""
    path, progress = folder / "run.mcap", folder / "progress"
    path.unlink(missing_ok=True)
    progress.write_bytes(bytes(PROGRESS.size))
    command = [sys.executable, __file__, "--produce", str(path), str(progress)]
    with subprocess.Popen(command, start_new_session=True) as child:
        while PROGRESS.unpack(progress.read_bytes())[1] < after * 1000:
            time.sleep(1e-3)
        recorder, handed_over = PROGRESS.unpack(progress.read_bytes())
        if recorder_alone:
            os.kill(recorder, signal.SIGKILL)
            time.sleep(0.05)
        os.killpg(child.pid, signal.SIGKILL)
    if not recorder_alone:
        handed_over = PROGRESS.unpack(progress.read_bytes())[1]
    return (handed_over - len(read_run(path).cycles)) * 1e-3


def main() -> None:
    """Kill and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("kills", nargs="?", type=int, default=20)
    parser.add_argument("--produce", nargs=2, metavar=("FILE", "PROGRESS"))
    options = parser.parse_args()
    if options.produce:
        produce(*map(Path, options.produce))
        return
    rng = random.Random(1)  # noqa: S311
    with tempfile.TemporaryDirectory() as folder:
        for alone, what in ((False, "run and recorder killed"), (True, "recorder alone killed")):
            lost = [kill_once(Path(folder), rng.uniform(0.2, 1.5), recorder_alone=alone) for _ in range(options.kills)]
            middle, most = np.median(lost) * 1e3, max(lost) * 1e3
            print(f"{what}, {len(lost)} times: lost {middle:.0f} ms (median), {most:.0f} ms (most)")


if __name__ == "__main__":
    main()
