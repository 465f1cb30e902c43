"""The tables of a scene file: keys with their units, bounds, and what each becomes in SI units."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, model_validator

from excitation import ConstantPulse, CosineWave, DoublePulse, Pulse, Record, SineWave
from twin.errors import InputError
from twin.rocking.block import Block
from twin.text_file import read_text

Positive = Annotated[float, Field(gt=0)]
NotNegative = Annotated[float, Field(ge=0)]


class Part(BaseModel):
    """A table of the scene file: no unknown keys, nothing that is not finite, no number given as text."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, strict=True)


class BlockPart(Part):
    """`[block]`: the specimen as the twin knows it."""

    width_mm: Annotated[float, Field(gt=0, le=1e5)]
    height_mm: Annotated[float, Field(gt=0, le=1e5)]
    mass_kg: Positive | None = None
    gravity_m_s2: Positive = 9.81
    restitution: Annotated[float, Field(ge=0, le=1)] | None = None
    friction: Annotated[float, Field(gt=0, le=100)] | None = None
    initial_rotation_deg: Annotated[float, Field(gt=-90, lt=90)] = 0.0

    def block(self) -> Block:
        """Return the block in SI units."""
        return Block(self.width_mm / 1000.0, self.height_mm / 1000.0, self.mass_kg, self.gravity_m_s2)


def _one_of(part: BaseModel, stem: str) -> None:
    given = [unit for unit in ("g", "m_s2") if getattr(part, f"{stem}_{unit}") is not None]
    if len(given) != 1:
        what = "both are given" if given else "neither is given"
        raise ValueError(f"give {stem}_g or {stem}_m_s2, in one unit: {what}")


class NoShaking(Part):
    """`kind = "none"`: the table stands still."""

    kind: Literal["none"]
    duration_s: Annotated[float, Field(ge=0.01, le=3600)] = 5.0

    def pulse(self, gravity: float, folder: Path) -> Pulse | None:  # noqa: ARG002 - the same call for every kind
        """Return None: nothing shakes."""
        return None


class ConstantPart(Part):
    """`kind = "constant"`: a constant pulse."""

    kind: Literal["constant"]
    acceleration_g: float | None = None
    acceleration_m_s2: float | None = None
    duration_s: Positive

    @model_validator(mode="after")
    def _unit(self) -> ConstantPart:
        _one_of(self, "acceleration")
        return self

    def pulse(self, gravity: float, folder: Path) -> Pulse:  # noqa: ARG002
        """Return the pulse in SI units."""
        return ConstantPulse(_si(self.acceleration_g, self.acceleration_m_s2, gravity), self.duration_s)


class WavePart(Part):
    """`kind = "sine"` or `"cosine"`."""

    kind: Literal["sine", "cosine"]
    amplitude_g: float | None = None
    amplitude_m_s2: float | None = None
    frequency_hz: Positive
    cycles: Positive = 1.0

    @model_validator(mode="after")
    def _unit(self) -> WavePart:
        _one_of(self, "amplitude")
        return self

    def pulse(self, gravity: float, folder: Path) -> Pulse:  # noqa: ARG002
        """Return the pulse in SI units."""
        wave = SineWave if self.kind == "sine" else CosineWave
        return wave(_si(self.amplitude_g, self.amplitude_m_s2, gravity), self.frequency_hz, self.cycles)


class DoublePulsePart(Part):
    """`kind = "double_pulse"`: ROORI1."""

    kind: Literal["double_pulse"]
    peak_velocity_m_s: float
    stop_gap_mm: Positive
    rebound: Annotated[float, Field(ge=0, le=1)] = 0.0
    pulse_acceleration_m_s2: Positive = 100.0

    def pulse(self, gravity: float, folder: Path) -> Pulse:  # noqa: ARG002
        """Return the pulse in SI units."""
        return DoublePulse(
            self.peak_velocity_m_s, self.stop_gap_mm / 1000.0, self.rebound, self.pulse_acceleration_m_s2
        )


class RecordPart(Part):
    """`kind = "record"`: a measured accelerogram, PEER AT2 or CSV; a relative path starts at the scene's folder."""

    kind: Literal["record"]
    path: Annotated[str, Field(min_length=1)]
    scale: float = 1.0

    def pulse(self, gravity: float, folder: Path) -> Pulse:
        """Return the record in SI units, read from its file."""
        path = folder / self.path
        text = read_text(path)
        read = Record.from_csv if path.suffix.lower() == ".csv" else Record.from_at2
        try:
            return read(text, scale=self.scale, gravity=gravity)
        except ValueError as error:
            raise InputError(f"record {path.name}: {error}") from None


def _si(in_g: float | None, in_si: float | None, gravity: float) -> float:
    return in_g * gravity if in_g is not None else in_si if in_si is not None else math.nan


Excitation = Annotated[NoShaking | ConstantPart | WavePart | DoublePulsePart | RecordPart, Field(discriminator="kind")]


class SpecimenPart(Part):
    """`[table.specimen]`: how the emulated block differs from the twin's, so that the two disagree honestly.

    `tilt_at_pulse_deg`: it leans by this, at rest, as the pulse begins, and is let go (Ceh 2018, section 3.5).
    """

    restitution_change_percent: Annotated[float, Field(ge=-50, le=50)] = -1.0
    slenderness_change_percent: Annotated[float, Field(ge=-50, le=50)] = 0.5
    tilt_at_pulse_deg: Annotated[float, Field(ge=-45, le=45)] = 0.0
    rotation_noise_rad: NotNegative = 2e-4


class TablePart(Part):
    """`[table]`: which table, and how the run around the pulse is made; `gain` scales the whole pulse.

    `patience_ms` is how long host and servo drive wait for each other before they stop the table; 20 ms unless given.
    """

    device: str
    capacity_file: str | None = None
    brake_m_s2: Positive | None = None
    coast_s: Annotated[float, Field(ge=0, le=60)] = 0.0
    settle_s: Annotated[float, Field(ge=0.1, le=60)] = 1.0
    gain: Annotated[float, Field(gt=0, le=1)] = 1.0
    patience_ms: Annotated[float, Field(ge=4, le=100)] | None = None
    seed: Annotated[int, Field(ge=0)] = 1
    specimen: SpecimenPart = SpecimenPart()


class TwinPart(Part):
    """`[twin]`: the live cycle, and the spreads (one standard deviation) of what is not known exactly.

    `rotation_noise_rad` is that of one reading of the specimen's sensor, as the observer takes it. `forecast = false`
    leaves observer and forecast out of the cycle. The plan draws its futures from the same spreads, unless
    `[uncertainty]` says otherwise; `futures` and `seed` are the plan's alone.
    """

    cycle_hz: Annotated[float, Field(ge=250, le=2000)] = 1000.0
    restitution_spread: NotNegative = 0.01
    slenderness_spread_percent: NotNegative = 0.5
    initial_tilt_spread_deg: NotNegative = 0.1
    rotation_noise_rad: Positive = 1e-3
    forecast: bool = True
    futures: Annotated[int, Field(ge=1, le=100_000)] = 10_000
    seed: Annotated[int, Field(ge=0)] = 1


PARTS: dict[str, type[BaseModel]] = {
    "block": BlockPart,
    "table": TablePart,
    "specimen": SpecimenPart,
    "twin": TwinPart,
    "none": NoShaking,
    "constant": ConstantPart,
    "sine": WavePart,
    "cosine": WavePart,
    "double_pulse": DoublePulsePart,
    "record": RecordPart,
}
"""Tables by the name they have in a scene file; excitations by their kind."""
