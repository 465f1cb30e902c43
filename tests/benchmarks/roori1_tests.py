"""The published double-pulse tests of a single block on ROORI-1 against the solver, over what was not published.

    python -m tests.benchmarks.roori1_tests ../shared/data/roori1_single_block_scale1_tests.csv

65 tests give stop gap, peak velocity and whether the block fell. Not published: the block's size, the shapes and
lengths of both pulses, the rebound. So each of three stated blocks is run under every combination of rebound 0 to 0.5
and pulse acceleration 30 to 100 m/s2, without friction, and the agreement is counted. Nothing is chosen by it.
"""

from __future__ import annotations

import argparse
import csv
from pathlib import Path

import numpy as np

from excitation import DoublePulse
from twin.rocking.block import Block
from twin.rocking.run import parameters
from twin.simulation import overturns

BLOCKS = {
    "60 x 270 mm (B6L)": Block(0.06, 0.27),
    "40 x 160 mm": Block(0.04, 0.16),
    "50 x 300 mm": Block(0.05, 0.30),
}
REBOUNDS = np.linspace(0.0, 0.5, 6)
ACCELERATIONS = np.array([30.0, 40.0, 50.0, 60.0, 80.0, 100.0])
SAFE_GAP = 12.5e-3
"""Up to this gap no block fell in any test, m."""


def read(path: Path) -> list[tuple[float, float, bool]]:
    """Return gap, m, peak velocity, m/s, and whether the block fell."""
    lines = [line for line in path.read_text(encoding="utf-8").splitlines() if line and not line.startswith("#")]
    return [
        (1e-3 * float(row["stop_gap_mm"]), float(row["peak_base_velocity_m_s"]), row["overturning"] != "none")
        for row in csv.DictReader(lines)
    ]


def falls(body: np.ndarray, gap: float, speed: float, rebound: float, acceleration: float) -> bool | None:
    """Return whether the block falls; None where the gap is too short for the pulse, or the outcome is undecided."""
    try:
        pulse = DoublePulse(speed, gap, float(rebound), float(acceleration))
    except ValueError:
        return None
    return overturns(body, pulse.pieces)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("file", type=Path)
    tests = read(parser.parse_args().file)
    fell = sum(test[2] for test in tests)
    near = [test[2] for test in tests if test[0] <= SAFE_GAP]
    print(f"{len(tests)} tests, {fell} fell; {len(near)} with gaps up to {SAFE_GAP * 1e3:g} mm, {sum(near)} fell")
    for name, block in BLOCKS.items():
        body = parameters(block, block.housner_restitution)
        print(f"\n{name}: alpha {block.slenderness:.3f} rad, p {block.frequency_parameter:.2f} rad/s")
        print(f"  tests right of {len(tests)}")
        print("  (in brackets the tests in which the pulse does not fit into the gap; * no block falls up to 12.5 mm)")
        print("  rebound " + "".join(f"{a:>12.0f} m/s2" for a in ACCELERATIONS))
        agreed = []
        for rebound in REBOUNDS:
            cells = []
            for acceleration in ACCELERATIONS:
                answers = [falls(body, gap, speed, rebound, acceleration) for gap, speed, _ in tests]
                right = sum(a == fell for a, (_, _, fell) in zip(answers, tests, strict=True))
                short = sum(a is None for a in answers)
                safe = not any(a for a, (gap, _, _) in zip(answers, tests, strict=True) if gap <= SAFE_GAP)
                agreed.append(right)
                cells.append(f"{right}{f' ({short})' if short else ''}{' *' if safe else ''}".rjust(17))
            print(f"  {rebound:7.1f} " + "".join(cells))
        print(f"  from {min(agreed)} to {max(agreed)} right")


if __name__ == "__main__":
    main()
