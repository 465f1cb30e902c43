"""What speaks against going on: a fault, a node that restarted or fell silent; each is one sentence and an error."""

from __future__ import annotations

from typing import TYPE_CHECKING

from devices.cia301 import frames
from devices.cia301.host import HEARTBEAT_LIMIT
from devices.errors import BusDisturbed, DeviceTimeout, DriveFault, DriveStopped

if TYPE_CHECKING:
    from devices.cia402.link import Link
    from devices.cia402.states import State


def fault(link: Link, name: str, state: State | None, remedy: str = "") -> DriveFault:
    """Return the drive's fault: the cause it told, or that it is in fault."""
    emergency = link.emergency
    if emergency is None:
        return DriveFault(f"{name} is in {state}, left by an earlier run or host{remedy}")
    text = frames.emergency_text(emergency.code)
    return DriveFault(f"{name} reports error {emergency.code:04X}: {text}; it is in {state}{remedy}", emergency.code)


def check(link: Link, name: str, state: State | None) -> None:
    """Raise where a node of the table has complained, restarted or fallen silent, or the bus is not to be trusted.

    Once a cycle, after `drain`.

    Raises
    ------
    BusDisturbed
        Where another master was heard, or the bus errs, repeats or reorders.
    DriveFault
        Where the drive sent an emergency.
    DriveStopped
        Where a node restarted or another one sent an emergency.
    DeviceTimeout
        Where a heartbeat is overdue.
    """
    # First: what the drive complains of then is what somebody else did to it.
    if (disturbance := link.disturbance()) is not None:
        raise BusDisturbed(f"{disturbance} on {link.bus}, the bus of {name}")
    if link.emergency is not None:
        raise fault(link, name, state)
    if link.restarted is not None:
        raise DriveStopped(f"node {link.restarted} of {name} is no longer operational: it was restarted")
    for node, emergency in link.emergencies.items():
        text = frames.emergency_text(emergency.code)
        raise DriveStopped(f"node {node} of {name} reports error {emergency.code:04X}: {text}")
    if (silent := link.silent()) is not None:
        raise DeviceTimeout(f"node {silent} of {name} has sent no heartbeat for {HEARTBEAT_LIMIT:g} s")
