"""Capacities as TOML: numbers with their units in the key names, and where each comes from."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from excitation import Capacity
from excitation.released import ReleasedMachine

STANDARD_GRAVITY = 9.81
"""m/s2, of `acceleration_g`."""

_Positive = Annotated[float, Field(gt=0.0, allow_inf_nan=False, strict=True)]


class _CapacityFile(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")

    name: Annotated[str, Field(min_length=1)]
    stroke_mm: _Positive
    velocity_m_s: _Positive
    acceleration_m_s2: _Positive | None = None
    acceleration_g: _Positive | None = None
    jerk_m_s3: _Positive | None = None
    frequency_hz: _Positive | None = None
    payload_kg: _Positive | None = None
    kinds: tuple[str, ...] | None = None
    one_signed: bool = False
    machine: dict[str, object] | None = None
    emulator: dict[str, object] = {}
    hil: dict[str, object] = {}
    provenance: dict[str, str] = {}


def load_capacity(source: str | Mapping[str, object], machine: type[ReleasedMachine] | None = None) -> Capacity:
    """Read a capacity from TOML text, or from a mapping with the same keys.

    Parameters
    ----------
    source : str or mapping
        `name`, `stroke_mm` (total), `velocity_m_s`, and `acceleration_g` or `acceleration_m_s2`; where they are limited
        also `jerk_m_s3`, `frequency_hz`, `payload_kg`, `kinds` (list of excitation kinds) and `one_signed`. A table
        `[provenance]` says where each number comes from, under its name without unit; without an entry that is
        "user's own number, no source given". 1 g is 9.81 m/s2. Further tables are not looked into: `load_own_tables`.

    Returns
    -------
    excitation.Capacity

    Raises
    ------
    ValueError
        One sentence: not TOML, an unknown or missing key, a number out of range.

    Examples
    --------
    >>> load_capacity('name = "mine"\\nstroke_mm = 100.0\\nvelocity_m_s = 0.5\\nacceleration_g = 1.0').stroke
    0.1
    """
    given = _read(source)
    if (given.acceleration_g is None) == (given.acceleration_m_s2 is None):
        raise ValueError(f"capacity of {given.name} needs one of acceleration_g and acceleration_m_s2")
    acceleration = given.acceleration_m_s2
    if acceleration is None:
        acceleration = (given.acceleration_g or 0.0) * STANDARD_GRAVITY
    limits: dict[str, object] = {
        "stroke": given.stroke_mm / 1000.0,
        "velocity": given.velocity_m_s,
        "acceleration": acceleration,
        "jerk": given.jerk_m_s3,
        "frequency": given.frequency_hz,
        "payload": given.payload_kg,
        "kinds": given.kinds,
        "one_signed": given.one_signed or None,
    }
    limits["machine"] = _machine(given, machine)
    limits = {name: value for name, value in limits.items() if value is not None}
    for name in given.provenance:
        if name not in limits:
            raise ValueError(f"capacity of {given.name} has provenance for {name!r}; it has {', '.join(limits)}")
    provenance = {
        name: given.provenance.get(name, "user's own number, no source given") for name in limits if name != "machine"
    }
    try:
        return Capacity.model_validate({"name": given.name, **limits, "provenance": provenance})
    except ValidationError as error:
        raise ValueError(f"capacity of {given.name} {_first_problem(error)}") from error


def load_own_tables(source: str | Mapping[str, object]) -> dict[str, Mapping[str, object]]:
    """Return what a capacity file says beside the capacity, by the table's name.

    `emulator` are the numbers of the device's emulator, `hil` those of Quanser's HIL API; both are empty where the file
    says nothing.

    Raises
    ------
    ValueError
        As `load_capacity`. The tables' own keys are the device's matter: `devices.own_table`.
    """
    given = _read(source)
    return {"emulator": given.emulator, "hil": given.hil}


def _read(source: str | Mapping[str, object]) -> _CapacityFile:
    content: Mapping[str, object]
    if isinstance(source, str):
        try:
            content = tomllib.loads(source)
        except tomllib.TOMLDecodeError as error:
            raise ValueError(f"capacity is not TOML: {error}") from error
    else:
        content = source
    try:
        return _CapacityFile.model_validate(content)
    except ValidationError as error:
        raise ValueError(f"capacity {_first_problem(error)}") from error


def _machine(given: _CapacityFile, kind: type[ReleasedMachine] | None) -> ReleasedMachine | None:
    """Return what the file's `[machine]` describes; such a table belongs to released machines, and to all of them."""
    if (given.machine is None) != (kind is None):
        has = "has no table [machine]" if given.machine is None else "has a table [machine], which is for others"
        raise ValueError(f"capacity of {given.name} {has}: see the file that ships with the device")
    if kind is None:
        return None
    try:
        return kind.model_validate(given.machine, by_alias=True, by_name=False)
    except ValidationError as error:
        raise ValueError(f"machine of {given.name} {_first_problem(error, kind)}") from error


def _first_problem(error: ValidationError, model: type[BaseModel] = _CapacityFile) -> str:
    first = error.errors(include_url=False)[0]
    key = ".".join(str(part) for part in first["loc"])
    if first["type"] == "extra_forbidden":
        # Known are the names of the outermost table; an inner one has few.
        known = (str(field.validation_alias or name) for name, field in model.model_fields.items())
        return f"has an unknown key {key!r}; it takes {', '.join(known)}"
    if first["type"] == "missing":
        return f"has no {key!r}"
    return f"has {key} = {first['input']!r}: {first['msg'].lower()}"
