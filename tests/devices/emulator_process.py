"""Run by test_two_processes in a process of its own (`runpy`, since spawn cannot import a test module by name)."""

from __future__ import annotations

import numpy as np

from devices.cia301.buses import open_bus
from devices.cia402.drive import DriveOptions
from devices.quanser_st3.emulator import EmulatedSt3

# handed in by runpy: stop and ready (events), report (pipe's end), port
if __name__ == "__emulator__":
    with open_bus("udp_multicast", port=globals()["port"]) as bus:
        emulator = EmulatedSt3(
            bus,
            rng=np.random.default_rng(1),
            specimen=lambda *_: 0.01,
            # a busy test machine stalls for longer than a laboratory's may
            options=DriveOptions(patience=100),
        )
        emulator.boot()
        globals()["ready"].set()
        emulator.serve(globals()["stop"])
        report = globals()["report"]
        report.send((str(emulator.drive.state), emulator.drive.standstill, emulator.drive.cycle))
        report.close()
