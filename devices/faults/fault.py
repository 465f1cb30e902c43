"""A fault to be injected, and what is known of its kind: where it acts, its size with unit and bounds, how long."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

from devices.errors import FaultRefused

Layer = Literal["bus", "node", "drive", "sensor", "mechanics", "host", "process"]
"""Where a fault acts: between a node and the bus, in the node's own controller, in the drive, in a sensor, in what the
drive moves, in the host, or on a whole process."""
Side = Literal["emulator", "host"]
"""The process a fault is injected in."""


@dataclass(frozen=True, slots=True)
class Size:
    """The one number of a fault.

    Attributes
    ----------
    text : str
        What it is.
    unit : str
        SI; "1" for a count or share.
    default, least, most : float
        Bounds are included.
    whole : bool
        Whether it is a whole number; it is then not 0 where the bounds lie on both sides of it.
    """

    text: str
    unit: str
    default: float
    least: float
    most: float
    whole: bool = False

    def check(self, value: float, where: str) -> None:
        """Refuse a value outside the bounds."""
        if not (math.isfinite(value) and self.least <= value <= self.most):
            unit = "" if self.unit == "1" else f" {self.unit}"
            raise FaultRefused(
                f"{where}: {self.text} is {value:g}{unit}; it must be {self.least:g} to {self.most:g}{unit}"
            )
        if self.whole and (value != int(value) or (value == 0.0 and self.least < 0.0)):
            raise FaultRefused(
                f"{where}: {self.text} is {value:g}; it must be a whole number{' but 0' * (value == 0.0)}"
            )


@dataclass(frozen=True, slots=True)
class FaultKind:
    """One kind of fault.

    Attributes
    ----------
    name : str
    layer : Layer
    side : Side
    text : str
        What it does, a clause.
    size : Size or None
    lasts : float or None
        How long unless told, s; None for what happens in an instant, inf for what stays to the end of the run.
    """

    name: str
    layer: Layer
    side: Side
    text: str
    size: Size | None = None
    lasts: float | None = None

    @property
    def line(self) -> str:
        """What it does, its size and how long, for a list of faults."""
        parts = [self.text]
        if self.size is not None:
            unit = "" if self.size.unit == "1" else f" {self.size.unit}"
            size = self.size
            parts.append(f"value: {size.text}, {size.default:g}{unit} ({size.least:g} to {size.most:g})")
        if self.lasts is not None:
            parts.append("to the end" if math.isinf(self.lasts) else f"for {self.lasts:g} s")
        return "; ".join(parts)


@dataclass(frozen=True, slots=True)
class Fault:
    """A fault at a time.

    Attributes
    ----------
    kind : FaultKind
    at : float
        Table's clock, s: it begins with the first cycle that is not before it.
    magnitude : float
        In the unit of the kind's size; 0 where it has none.
    duration : float
        s; one cycle at least, inf for the rest of the run; 0 for what happens in an instant.

    Raises
    ------
    FaultRefused
        A number outside its bounds.
    """

    kind: FaultKind
    at: float
    magnitude: float
    duration: float

    @property
    def name(self) -> str:
        """The kind's name."""
        return self.kind.name

    @property
    def sentence(self) -> str:
        """What is injected, for the recording."""
        size = self.kind.size
        if size is None:
            return self.kind.text
        return f"{self.kind.text} ({size.text}: {self.magnitude:g}{'' if size.unit == '1' else ' ' + size.unit})"


def fault_of(kind: FaultKind, at: float, magnitude: float | None = None, duration: float | None = None) -> Fault:
    """Return a fault of a kind, with the kind's own magnitude and duration where none are given.

    Raises
    ------
    FaultRefused
        One sentence: a number outside its bounds, or one this kind does not have.
    """
    where = f"fault {kind.name}"
    if not (math.isfinite(at) and at >= 0.0):
        raise FaultRefused(f"{where}: its time is {at:g} s; it must be finite and at least 0 s")
    if kind.size is None:
        if magnitude is not None:
            raise FaultRefused(f"{where} takes no value")
        magnitude = 0.0
    else:
        magnitude = kind.size.default if magnitude is None else magnitude
        kind.size.check(magnitude, where)
    if kind.lasts is None:
        if duration is not None:
            raise FaultRefused(f"{where} happens in an instant and takes no duration")
        duration = 0.0
    else:
        duration = kind.lasts if duration is None else duration
        if not duration > 0.0:
            raise FaultRefused(f"{where}: its duration is {duration:g} s; it must be above 0 s")
    return Fault(kind, at, magnitude, duration)
