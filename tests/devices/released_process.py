"""Run by test_released_processes in a process of its own (`runpy`, since spawn cannot import a test module by name)."""

from __future__ import annotations

import numpy as np

from devices.catalogue import find_device
from devices.cia301.buses import open_bus

# handed in by runpy: stop and ready (events), report (pipe's end), port, name
if __name__ == "__released__":
    with open_bus("udp_multicast", port=globals()["port"]) as bus:
        emulator = find_device(globals()["name"]).emulator(bus, rng=np.random.default_rng(1), payload=2.5)
        emulator.boot()
        globals()["ready"].set()
        emulator.serve(globals()["stop"])
        report = globals()["report"]
        report.send((emulator.release_device.armed, emulator.plant.held, emulator.plant.at_rest))
        report.close()
