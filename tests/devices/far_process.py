"""An emulator in a process of its own, on the multicast bus of this machine."""

from __future__ import annotations

import multiprocessing
import runpy
import socket
from pathlib import Path
from typing import Any

from devices.cia301.buses import open_bus
from devices.errors import DeviceError


def free_port() -> int:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("", 0))
        return probe.getsockname()[1]


def multicast_works(port: int) -> bool:
    try:
        with open_bus("udp_multicast", port=port) as one, open_bus("udp_multicast", port=port) as other:
            one.send(0x123, b"probe")
            return other.receive(0.2) == (0x123, b"probe")
    except DeviceError:
        return False


class FarProcess:
    """A script beside this file, run under `run_name`; it says `ready`, serves until `stop`, and reports.

    It is run by path: spawn cannot import a test module by name.
    """

    def __init__(self, script: str, run_name: str, **handed: object) -> None:
        spawn = multiprocessing.get_context("spawn")
        self.stop, self.ready = spawn.Event(), spawn.Event()
        self.report, far_end = spawn.Pipe(duplex=False)
        names = {"stop": self.stop, "ready": self.ready, "report": far_end, **handed}
        path = str(Path(__file__).with_name(script))
        self.process = spawn.Process(target=runpy.run_path, args=(path, names, run_name), daemon=True)
        self.process.start()
        far_end.close()

    def end(self) -> Any:
        """Stop it; return what it reports."""
        self.stop.set()
        assert self.report.poll(20.0)
        return self.report.recv()

    def close(self) -> None:
        self.stop.set()
        self.process.join(10.0)
        if self.process.is_alive():
            self.process.kill()
            self.process.join()
        self.process.close()
        self.report.close()
