"""What every fault comes to, as a Markdown table: `python tests/benchmarks/fault_table.py [NAME ...]`.

Deterministic: a manual clock, seeded noise. Each fault meets the emulated ST-III at its top speed in a cosine of 0.18 g
at 1 Hz (four cycles; nothing rocks), all of it through the live loop and frames on a virtual bus. One cycle is 1 ms.
Times are those of the emulated plant itself, until its true velocity stays below 0.1 mm/s; the acceleration is the
plant's largest from the fault on. The bounds are asserted by tests/twin/test_faults.py, in a shorter scene.
"""

from __future__ import annotations

import math
import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))

from devices.faults.catalogue import FAULTS, parse_fault  # noqa: E402
from devices.quanser_st3.capacity import CAPACITY  # noqa: E402
from tests.twin.conftest import short_scene  # noqa: E402
from tests.twin.fault_run import Suffered, suffer  # noqa: E402
from twin.rehearsal import rehearse  # noqa: E402
from twin.stopping import stop_deceleration  # noqa: E402

SCENE = short_scene('kind = "cosine"\namplitude_g = 0.18\nfrequency_hz = 1\ncycles = 4')
AT = round(rehearse(SCENE, CAPACITY).motion.pulse_start + 2.25, 3)
LONGER = ("host_stall:0.05",)
"""Other sizes worth a row."""


def main() -> None:
    """Print the table, its conditions above it."""
    names = sys.argv[1:] or [*FAULTS, *LONGER]
    speed = 0.18 * 9.81 / math.tau
    ramp = stop_deceleration(SCENE, CAPACITY)
    print(f"Top speed {speed:.3f} m/s, ramp {ramp:.2f} m/s2: {1e3 * speed / ramp:.0f} ms of ramp alone.\n")
    print("| fault | ms (cycles) to standstill | largest acceleration, m/s2 | device | host, as recorded |")
    print("|---|---|---|---|---|")
    for name in names:
        kind, _, value = name.partition(":")
        run = suffer(SCENE, parse_fault(f"{kind}@{AT}" + (f":{value}" if value else "")))
        print(f"| `{name}` | {standstill(run)} | {acceleration(run)} | {device(run)} | {host(run)} |", flush=True)


def standstill(run: Suffered) -> str:
    """Return how long the table moved on."""
    if run.fault.name == "emulator_killed":
        return "its process is gone"
    if run.report.tripped is None and run.fault.name != "host_killed":
        return "goes on"
    return "never" if run.standstill is None else f"{run.standstill * 1e3:.0f}"


def acceleration(run: Suffered) -> str:
    """Return the largest true acceleration from the fault on."""
    values = [abs(look.acceleration) for look in run.since]
    return f"{max(values):.2f}" if values and run.fault.name != "emulator_killed" else "-"


def device(run: Suffered) -> str:
    """Return the drive's end, by its own account."""
    if run.fault.name == "emulator_killed":
        return "-"
    drive = run.emulator.drive
    code = f" ({drive.error:04X})" if drive.error else ""
    return f"{drive.state}{code}, power {'on' if run.emulator.plant.powered else 'off'}"


def host(run: Suffered) -> str:
    """Return what the recording says, without the bus's own name."""
    if run.fault.name == "host_killed":
        return "gone; the recording ends"
    missed = f"{run.report.missed} cycles missed" if run.report.missed else "nothing missed"
    if run.report.tripped is None:
        return f"goes on, {missed}"
    words = re.sub(r"Virtual bus channel test-fault-\d+", "the bus", run.said("trip"))
    return f"{words}; **{run.story[-1]}**"


if __name__ == "__main__":
    main()
