"""One cycle on the virtual bus: `python tests/benchmarks/run_exchange.py [--cycles N] [--runs N]`.

Host and emulated drive on one thread, a stiff machine, no sensor: what the protocol costs, both sides of it together.
Median, 99 % and 99.9 % of `exchange`, of several runs; the machine should have nothing else to do.
"""

from __future__ import annotations

import argparse
import gc
import math
import statistics
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from devices.cia301.buses import open_bus
from devices.cia402.drive import Drive
from devices.cia402.master import Cia402Table
from excitation import Capacity

CAPACITY = Capacity(name="bench", stroke=0.2, velocity=0.5, acceleration=10.0, provenance={})
H = 1e-3


class Stiff:
    """Is where it is told to be."""

    position = velocity = 0.0

    def advance(self, setpoint: float) -> None:
        """Go there."""
        self.velocity = (setpoint - self.position) / H
        self.position = setpoint

    def measure_position(self) -> float:
        """m."""
        return self.position

    def measure_acceleration(self) -> float:
        """m/s2."""
        return 1.5


def run(cycles: int) -> list[float]:
    """Return how long each exchange took, s, sorted."""
    with open_bus("virtual", "benchmark") as near, open_bus("virtual", "benchmark") as far:
        drive = Drive(1, far.send, Stiff(), CAPACITY, H)
        drive.boot()

        def idle() -> None:
            while (frame := far.receive()) is not None:
                drive.receive(*frame)
            drive.node.beat(time.perf_counter())

        table = Cia402Table(near, CAPACITY, idle=idle)
        table.open()
        table.enable(table.position)
        gc.freeze()
        took = []
        for cycle in range(cycles):
            target = 0.01 * (1.0 - math.cos(math.tau * (cycle + 1) * H))
            start = time.perf_counter()
            table.exchange(cycle, target)
            took.append(time.perf_counter() - start)
        table.quick_stop()
        gc.unfreeze()
    return sorted(took)


def main() -> None:
    """Print one line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cycles", type=int, default=10_000)
    parser.add_argument("--runs", type=int, default=5)
    options = parser.parse_args()
    runs = [run(options.cycles) for _ in range(options.runs)]
    shares = {"median": 0.5, "99 %": 0.99, "99.9 %": 0.999}
    told = (
        f"{name} {1e6 * statistics.median(took[int(share * len(took))] for took in runs):.1f} us"
        for name, share in shares.items()
    )
    print(f"exchange: {', '.join(told)} ({options.runs} runs of {options.cycles} cycles)")


if __name__ == "__main__":
    main()
