"""Capacities as TOML: numbers with their units in the key names, and where each comes from."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from excitation import Capacity

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
    provenance: dict[str, str] = {}


def load_capacity(source: str | Mapping[str, object]) -> Capacity:
    """Read a capacity from TOML text, or from a mapping with the same keys.

    Parameters
    ----------
    source : str or mapping
        `name`, `stroke_mm` (total), `velocity_m_s`, and `acceleration_g` or `acceleration_m_s2`; where they are limited
        also `jerk_m_s3`, `frequency_hz`, `payload_kg`, `kinds` (list of excitation kinds) and `one_signed`. A table
        `[provenance]` says where each number comes from, under its name without unit; without an entry that is
        "user's own number, no source given". 1 g is 9.81 m/s2.

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
    content: Mapping[str, object]
    if isinstance(source, str):
        try:
            content = tomllib.loads(source)
        except tomllib.TOMLDecodeError as error:
            raise ValueError(f"capacity is not TOML: {error}") from error
    else:
        content = source
    try:
        given = _CapacityFile.model_validate(content)
    except ValidationError as error:
        raise ValueError(f"capacity {_first_problem(error)}") from error
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
    limits = {name: value for name, value in limits.items() if value is not None}
    for name in given.provenance:
        if name not in limits:
            raise ValueError(f"capacity of {given.name} has provenance for {name!r}; it has {', '.join(limits)}")
    provenance = {name: given.provenance.get(name, "user's own number, no source given") for name in limits}
    try:
        return Capacity.model_validate({"name": given.name, **limits, "provenance": provenance})
    except ValidationError as error:
        raise ValueError(f"capacity of {given.name} {_first_problem(error)}") from error


def _first_problem(error: ValidationError) -> str:
    first = error.errors(include_url=False)[0]
    key = ".".join(str(part) for part in first["loc"])
    if first["type"] == "extra_forbidden":
        return f"has an unknown key {key!r}; it takes {', '.join(_CapacityFile.model_fields)}"
    if first["type"] == "missing":
        return f"has no {key!r}"
    return f"has {key} = {first['input']!r}: {first['msg'].lower()}"
