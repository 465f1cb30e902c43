"""The runs among which one is looked for: a scene's own kind of pulse, its size and its shape free.

Sizes and shapes are the numbers of the scene file, in its units, so that what is found is what is written.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from excitation import Capacity, Pulse
from twin.errors import InputError
from twin.rehearsal import clip_scene
from twin.scene import Scene
from twin.scene_parts import ConstantPart, DoublePulsePart, Excitation, NoShaking, WavePart

DIGITS = 3
"""Significant digits of a shape and, with one more, of a size: what a person sets and writes down."""
FASTEST, SLOWEST = 12.0, 0.25
"""Frequencies looked at, omega in p."""
LONGEST, SHORTEST = 5.0, 0.05
"""Durations of constant pulses looked at, in 1/p."""
LEAST, LARGEST = 0.8, 40.0
"""Sizes looked at, in peak accelerations over that which lifts the block: below it stands still."""


@dataclass(frozen=True, slots=True)
class Axis:
    """One free number of the pulse.

    Attributes
    ----------
    key : str
        Its key in the scene file; empty where there is none (a record has no shape).
    unit : str
        What is written behind a number.
    low, high : float
        The range looked at, in the file's unit, both above 0.
    """

    key: str
    unit: str
    low: float
    high: float


class Family:
    """A scene's pulses of every size and shape on a table.

    Parameters
    ----------
    scene : Scene
    capacity : Capacity

    Raises
    ------
    InputError
        Where nothing shakes, or the scene runs at a staged level already.
    """

    def __init__(self, scene: Scene, capacity: Capacity) -> None:
        if isinstance(scene.excitation, NoShaking):
            raise InputError(f"scene {scene.name} has no excitation: there is no amplitude to look for")
        if scene.table.gain != 1.0:
            raise InputError(
                f"scene {scene.name}: table.gain is {scene.table.gain:g}; whole pulses are looked for, leave it out"
            )
        self.scene = scene
        self.capacity = capacity
        self.block = scene.block.block()
        self.size, self.shape = _axes(scene, capacity)
        asked = getattr(scene.excitation, self.size.key)
        self.size_name, self.shape_name = _names(scene.excitation)
        self._sense = -1.0 if asked < 0.0 else 1.0
        self.asked = abs(float(asked)), float(getattr(scene.excitation, self.shape.key)) if self.shape.key else 1.0
        """Size and shape of the scene's own pulse."""

    def rounded(self, size: float, shape: float, *, down: bool = False) -> tuple[float, float]:
        """Return size and shape with as many digits as are written; `down`: the size never grows."""
        exact = self.asked[1]
        return significant(size, DIGITS + 1, down=down), exact if shape == exact else significant(shape, DIGITS)

    def part(self, size: float, shape: float) -> Excitation:
        """Return the excitation of a scene file; raises `ValueError` where there is none such."""
        own = self.scene.excitation
        numbers: dict[str, Any] = {self.size.key: self._sense * size}
        if self.shape.key:
            numbers[self.shape.key] = shape
        return type(own).model_validate({**own.model_dump(exclude_none=True), **numbers})

    def scene_of(self, size: float, shape: float) -> Scene:
        """Return the scene of one run."""
        return self.scene.with_excitation(self.part(size, shape))

    def pulse(self, size: float, shape: float) -> Pulse | None:
        """Return the pulse; None where there is none (a double pulse whose gap is shorter than its run-up)."""
        try:
            return self.scene_of(size, shape).pulse()
        except ValueError:
            return None

    def fits(self, size: float, shape: float) -> bool:
        """Return whether the table makes the pulse exactly as asked, by the clip that every run goes through."""
        try:
            pulse = self.pulse(size, shape)
            return pulse is not None and clip_scene(self.scene, self.capacity, pulse).feasible
        except ValueError:
            return False

    def fits_at(self, size: float, shape: float, gain: float) -> bool:
        """Return whether the table makes `gain` of the whole pulse exactly, as a staged level."""
        try:
            scene = self.scene_of(size, shape).with_gain(gain)
            pulse = scene.pulse()
            return pulse is not None and clip_scene(scene, self.capacity, pulse).feasible
        except ValueError:
            return False

    def largest(self, shape: float) -> float | None:
        """Return the size to which the clip reduces a pulse too large; None where it changes more than the size."""
        pulse = self.pulse(self.size.high, shape)
        try:
            clipped = None if pulse is None else clip_scene(self.scene, self.capacity, pulse)
        except ValueError:
            return None
        if pulse is None or clipped is None or not isinstance(clipped.given, type(pulse)):
            return None
        if clipped.feasible:
            return self.size.high
        return self.size.high * clipped.factor * (1.0 - 1e-9) if clipped.given.duration == pulse.duration else None

    def largest_that_fits(self, shape: float, near: float) -> float | None:
        """Return a size of a shape that fits, at most a hundredth below `near`; None where there is none."""
        sizes = (near * (1.0 - 0.002 * k) for k in range(6))
        return next((size for size in sizes if math.isfinite(size) and self.fits(size, shape)), None)

    def words(self, size: float, shape: float) -> str:
        """Return the pulse in a few words: "0.61 g at 3.2 Hz"."""
        first = self.size_words(size)
        return f"{first} {self.between} {shape:.{DIGITS + 1}g} {self.shape.unit}" if self.shape.key else first

    @property
    def between(self) -> str:
        """The word between size and shape."""
        part = self.scene.excitation
        return "at" if isinstance(part, WavePart) else "for" if isinstance(part, ConstantPart) else "over a gap of"

    def size_words(self, size: float) -> str:
        """Return a size with its unit: "0.61 g"."""
        return f"{self._sense * size:.{DIGITS + 1}g} {self.size.unit}"


def _names(part: Excitation) -> tuple[str, str]:
    """Return what size and shape are called."""
    if isinstance(part, ConstantPart):
        return "acceleration", "duration"
    if isinstance(part, DoublePulsePart):
        return "velocity", "gap"
    return ("amplitude", "frequency") if isinstance(part, WavePart) else ("scale", "")


def significant(value: float, digits: int, *, down: bool = False) -> float:
    """Return `value` with so many significant digits; `down` towards 0.

    Examples
    --------
    >>> significant(0.123456, 3), significant(0.6789, 3, down=True), significant(0.3, 3, down=True)
    (0.123, 0.678, 0.3)
    """
    if value == 0.0:
        return 0.0
    nearest = float(f"{value:.{digits - 1}e}")
    if not down or abs(nearest) <= abs(value):
        return nearest
    step = 10.0 ** (math.floor(math.log10(abs(value))) - digits + 1)
    return float(f"{nearest - math.copysign(step, value):.{digits - 1}e}")


def _axes(scene: Scene, capacity: Capacity) -> tuple[Axis, Axis]:
    """Return the axes of size and shape of the scene's kind of pulse."""
    part, block = scene.excitation, scene.block.block()
    p, lift = block.frequency_parameter, block.uplift_acceleration
    if isinstance(part, WavePart):
        fastest = FASTEST * p / (2.0 * math.pi)
        if capacity.frequency is not None:
            # The last digit that is written must not take it beyond.
            fastest = min(fastest, significant(capacity.frequency, DIGITS, down=True))
        shape = Axis("frequency_hz", "Hz", min(SLOWEST * p / (2.0 * math.pi), fastest), fastest)
        return _amplitude(part, "amplitude", lift, block.gravity), shape
    if isinstance(part, ConstantPart):
        shape = Axis("duration_s", "s", SHORTEST / p, LONGEST / p)
        return _amplitude(part, "acceleration", lift, block.gravity), shape
    if isinstance(part, DoublePulsePart):
        longest = 1e3 * capacity.stroke
        shape = Axis("stop_gap_mm", "mm", min(2.0, 0.5 * longest), longest)
        return Axis("peak_velocity_m_s", "m/s", 0.02 * capacity.velocity, capacity.velocity), shape
    pulse = scene.pulse()
    scale = abs(getattr(part, "scale", 1.0))
    peak = 0.0 if pulse is None else pulse.peak_acceleration
    if peak == 0.0:
        raise InputError(f"scene {scene.name}: its record shakes nothing: there is no amplitude to look for")
    return Axis("scale", "of the record", LEAST * scale * lift / peak, LARGEST * scale * lift / peak), Axis(
        "", "", 1.0, 1.0
    )


def _amplitude(part: object, stem: str, lift: float, gravity: float) -> Axis:
    in_g = getattr(part, f"{stem}_g") is not None
    unit = lift / gravity if in_g else lift
    return Axis(f"{stem}_{'g' if in_g else 'm_s2'}", "g" if in_g else "m/s2", LEAST * unit, LARGEST * unit)
