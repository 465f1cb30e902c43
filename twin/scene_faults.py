"""`[[fault]]` of a scene file: what goes wrong in a run on an emulated table, and when."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field, model_validator

from devices.errors import FaultRefused
from devices.faults.catalogue import find_fault, parse_fault
from devices.faults.fault import Fault, fault_of
from twin.errors import InputError
from twin.scene_parts import Part, Positive


class FaultPart(Part):
    """`[[fault]]`: one fault by its name, at a time of the table's clock; size and length are the fault's own."""

    name: str
    at_s: Annotated[float, Field(ge=0)]
    duration_s: Positive | None = None
    magnitude: float | None = None

    @model_validator(mode="after")
    def _possible(self) -> FaultPart:
        self.fault()
        return self

    def fault(self) -> Fault:
        """Return the fault; `FaultRefused` where there is no such one."""
        return fault_of(find_fault(self.name), self.at_s, self.magnitude, self.duration_s)


def fault_parts(texts: list[str]) -> list[FaultPart]:
    """Return what `--fault NAME@SECONDS` or `NAME@SECONDS:VALUE` ask for.

    Raises
    ------
    InputError
        One sentence: no such fault, or a number it cannot have.

    Examples
    --------
    >>> fault_parts(["sync_lost@2.5:3"])[0].magnitude
    3.0
    """
    parts: list[FaultPart] = []
    for text in texts:
        try:
            fault = parse_fault(text)
        except FaultRefused as error:
            raise InputError(f"--fault: {error}") from None
        size = None if fault.kind.size is None else fault.magnitude
        parts.append(FaultPart(name=fault.name, at_s=fault.at, magnitude=size))
    return parts
