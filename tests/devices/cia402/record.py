"""Records the two sessions anew: `python -m tests.devices.cia402.record`, then run the tests."""

from __future__ import annotations

from devices.cia301.buses import open_bus
from devices.clock import WallClock
from tests.devices.cia402 import canopen_master, host_session
from tests.devices.cia402.canopen_servo import local_servo
from tests.devices.cia402.traffic import DATA, Frame, write_blf


def master() -> list[Frame]:
    """canopen's master and our drive, as the drive sends and hears it."""
    with canopen_master.bench("record master") as (rig, node):
        canopen_master.session(rig, node)
    return rig.frames


def servo() -> list[Frame]:
    """Our host and canopen's servo, as the host sends and hears it."""
    frames: list[Frame] = []
    with local_servo("record servo") as far, open_bus("virtual", "record servo") as bus:
        bus.tap = lambda *frame: frames.append(Frame(*frame))
        host_session.session(bus, WallClock(), lambda: far.fail(0x7500))
    return frames


if __name__ == "__main__":
    DATA.mkdir(exist_ok=True)
    write_blf(DATA / "canopen_master_our_drive.blf", master())
    write_blf(DATA / "our_host_canopen_servo.blf", servo())
