"""What a table answers: a sample a cycle, a description of every node; and what stands on an emulated one."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

Specimen = Callable[[float, float, float], float]
"""What stands on an emulated table: (duration s, base acceleration at its start, at its end m/s2, linear between) ->
rotation at its end, rad. Each call goes on from where the last one ended."""


@dataclass(frozen=True, slots=True)
class Sample:
    """What a table measured at the start of one cycle.

    Attributes
    ----------
    cycle : int
        Number of the cycle, the host's own count.
    time : float
        Table's clock, s: `cycle` times the cycle time.
    position : float
        Measured base position, m, 0 at the centre of the stroke, positive towards +x.
    acceleration : float
        Measured base acceleration, m/s2, positive towards +x.
    rotation : float
        Measured rotation of the specimen, rad, positive when its top leans to +x; NaN without a sensor.
    status : int
        The drive's CiA 402 statusword (object 6041).
    """

    cycle: int
    time: float
    position: float
    acceleration: float
    rotation: float
    status: int


@dataclass(frozen=True, slots=True)
class Description:
    """Who one node of a table says it is, and what it does.

    Attributes
    ----------
    node : int or None
        Number on the bus; None where there is no bus.
    what : str
        Its part in the table, e.g. "drive".
    name, hardware, software : str
        As its maker names it, with versions; empty where it does not tell.
    vendor, product, revision, serial : int
        CANopen identity (object 1018), or what comes close to it.
    state : str
        E.g. "switch on disabled", "operational".
    mode : str
        E.g. "cyclic synchronous position"; empty where it has none.
    """

    node: int | None
    what: str
    name: str
    hardware: str
    software: str
    vendor: int
    product: int
    revision: int
    serial: int
    state: str
    mode: str
