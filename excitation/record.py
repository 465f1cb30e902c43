"""A measured accelerogram as a pulse."""

from __future__ import annotations

from typing import Annotated

import numpy as np
import numpy.typing as npt
from pydantic import BeforeValidator, Field, ValidationError
from pydantic.dataclasses import dataclass

from excitation.accelerogram import MAX_SAMPLES, Accelerogram, parse_at2, parse_csv
from excitation.pieces import Array
from excitation.pulse import Pulse
from excitation.quantity import LARGEST, VALUE, checked, quantity, refusal


def _frozen_samples(value: npt.ArrayLike) -> Array:
    """Return an own read-only copy of finite samples, shape (n,)."""
    try:
        samples = np.array(value)
    except ValueError:
        raise refusal("samples must be numbers in one row") from None
    if samples.ndim != 1 or samples.dtype.kind not in "iuf":
        raise refusal(f"samples must be numbers in one row, not {samples.dtype.name} of shape {samples.shape}")
    if not 2 <= len(samples) <= MAX_SAMPLES:
        raise refusal(f"a record has {len(samples)} samples; it must have 2 to {MAX_SAMPLES}")
    samples = samples.astype(np.float64)
    wrong = np.flatnonzero(~(np.abs(samples) <= LARGEST))
    if len(wrong):
        at = int(wrong[0])
        raise refusal(f"sample {at} is {samples[at]:g} m/s2; samples must be finite and at most {LARGEST:g} m/s2")
    samples.flags.writeable = False
    return samples


@dataclass(frozen=True, config=VALUE, eq=False)
class Record(Pulse):
    """Acceleration linear between equally spaced samples: n samples last (n - 1) time_step.

    Velocity and displacement are its exact integrals from rest, without any correction, so a record usually ends moving
    a little, and its run needs a brake.

    Parameters
    ----------
    samples : array_like, shape (n,)
        Base acceleration, m/s2, n from 2 to `MAX_SAMPLES`; copied, kept read-only.
    time_step : float
        Time between samples, s, above 0.
    name : str
        What was recorded, where and when.

    Raises
    ------
    pydantic.ValidationError
        A `ValueError`; its message names the value, its limit and unit.

    Examples
    --------
    >>> record = Record([0.0, 2.0, 0.0], 0.5)
    >>> record.duration, record.acceleration(0.25), record.final_velocity
    (1.0, 1.0, 1.0)
    """

    samples: Annotated[Array, BeforeValidator(_frozen_samples)] = Field(repr=False)
    time_step: Annotated[float, quantity("s", above=0.0)] = Field()
    name: Annotated[str, Field(max_length=200)] = "record"

    @classmethod
    def from_at2(cls, text: str, scale: float = 1.0, gravity: float = 9.81) -> Record:
        """Return the record in a PEER AT2 text (samples in g), each sample times `scale`.

        Parameters
        ----------
        text : str
            The file's content; see `excitation.accelerogram.parse_at2`.
        scale : float
            Pure number.
        gravity : float
            1 g in m/s2.

        Raises
        ------
        ValueError
            One sentence: no AT2 text, units other than g, missing samples, a value that is no finite number.
        """
        return cls._from(parse_at2(text), scale, gravity)

    @classmethod
    def from_csv(cls, text: str, scale: float = 1.0, gravity: float = 9.81) -> Record:
        """Return the record in a CSV text with columns `time_s` and `acceleration_m_s2` or `acceleration_g`.

        Parameters and errors as in `from_at2`; see `excitation.accelerogram.parse_csv`.

        Examples
        --------
        >>> Record.from_csv("time_s,acceleration_g\\n0,0\\n0.5,0.1\\n1,0", gravity=10.0).peak_acceleration
        1.0
        """
        return cls._from(parse_csv(text), scale, gravity)

    @classmethod
    def _from(cls, parsed: Accelerogram, scale: float, gravity: float) -> Record:
        unit = checked("gravity", gravity, "m/s2", above=0.0) if parsed.in_g else 1.0
        factor = checked("scale", scale) * unit
        with np.errstate(over="ignore"):
            samples = parsed.samples * factor
        try:
            return cls(samples, parsed.time_step, parsed.name)
        except ValidationError as error:
            raise ValueError(error.errors()[0]["msg"]) from None

    @property
    def family(self) -> str:
        """What a capacity's `kinds` call it."""
        return "record"

    @property
    def kind(self) -> str:
        """What sentences call it."""
        return "record"

    def scaled(self, factor: float) -> Record:
        """Return the record with every sample times `factor`, so that its shape and its time stay."""
        return Record(self.samples * checked("factor", factor), self.time_step, self.name)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Record):
            return NotImplemented
        same = (self.time_step, self.name) == (other.time_step, other.name)
        return same and np.array_equal(self.samples, other.samples)

    def __hash__(self) -> int:
        return hash((self.samples.tobytes(), self.time_step, self.name))

    def __reduce__(self) -> tuple[type[Record], tuple[Array, float, str]]:
        # Pickled arrays come back writeable; the constructor makes them read-only again.
        return Record, (self.samples, self.time_step, self.name)

    def _rows(self) -> Array:
        a, times = self.samples, np.arange(len(self.samples)) * self.time_step
        rows = np.zeros((len(a) - 1, 7))
        rows[:, 0], rows[:, 1] = times[:-1], times[1:]
        rows[:, 2] = a[:-1]
        rows[:, 3] = np.diff(a) / np.diff(times)
        return rows
