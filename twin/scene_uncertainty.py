"""`[uncertainty]` of a scene file: what is not known exactly, as distributions that the plan draws its futures from."""

from __future__ import annotations

import math
from typing import Annotated, Literal

from pydantic import Field, model_validator

from twin.scene_parts import NotNegative, Part, TwinPart


class SpreadPart(Part):
    """A distribution: `{ spread = }`, normal, one standard deviation about `mean`; or `{ low =, high = }`, uniform.

    Where `mean` is left out it is the scene's own value.
    """

    mean: float | None = None
    spread: NotNegative | None = None
    low: float | None = None
    high: float | None = None

    @model_validator(mode="after")
    def _one_form(self) -> SpreadPart:
        normal, uniform = self.spread is not None, self.low is not None and self.high is not None
        if normal == uniform or (normal and (self.low is not None or self.high is not None)):
            raise ValueError("give { spread = } with or without mean (normal), or { low =, high = } (uniform)")
        if self.mean is not None and not normal:
            raise ValueError("give { spread = } with or without mean (normal), or { low =, high = } (uniform)")
        if uniform and not (self.low or 0.0) <= (self.high or 0.0):
            raise ValueError(f"low is {self.low:g}; it must not be above high, {self.high:g}")
        return self

    def centre(self, own: float) -> float:
        """Return the mean; `own` is the scene's value."""
        if self.low is not None and self.high is not None:
            return 0.5 * (self.low + self.high)
        return own if self.mean is None else self.mean

    @property
    def deviation(self) -> float:
        """One standard deviation."""
        if self.low is not None and self.high is not None:
            return (self.high - self.low) / math.sqrt(12.0)
        return self.spread or 0.0

    def words(self, unit: str, own: float) -> str:
        """Return the distribution in words; `own` is the scene's value."""
        unit = f" {unit}" if unit else ""
        if self.low is not None and self.high is not None:
            return f"{self.low:g} to {self.high:g}{unit}"
        centre = "" if self.mean is None or self.mean == own else f"{self.mean:g} "
        return f"{centre}+-{self.deviation:g}{unit}"


def spread(deviation: float) -> SpreadPart:
    """Return a normal distribution about the scene's own value."""
    return SpreadPart(spread=deviation)


Response = Literal["known", "asked", "emulator", "measured", "file"]
"""Whose base motion the futures feel: the best that is known; as asked; the emulated table's loop; as `twin tune` has
measured it; by a transfer function in a file."""


class TableUncertaintyPart(Part):
    """`[uncertainty.table]`: how the table makes the motion it is asked for, and how surely.

    `gain_percent` is an error of the whole amplitude, `delay_ms` one of when it begins (it matters only to a block that
    is let go before the pulse), `noise_m_s2` the standard deviation of what shakes the base beside it, up to
    `noise_hz`; `rebound` is that of a released machine's end stop. `response_file` belongs to `response = "file"`.
    """

    response: Response = "known"
    response_file: str | None = None
    gain_percent: SpreadPart = spread(1.0)
    delay_ms: SpreadPart = spread(0.0)
    noise_m_s2: NotNegative = 0.0
    noise_hz: Annotated[float, Field(gt=0, le=500)] = 30.0
    rebound: SpreadPart = spread(0.02)

    @model_validator(mode="after")
    def _file_if_asked(self) -> TableUncertaintyPart:
        if (self.response == "file") is (self.response_file is None):
            raise ValueError('response = "file" needs response_file, and nothing else has one')
        return self


class UncertaintyPart(Part):
    """`[uncertainty]`; what is left out of the first five is `[twin]`'s, which the live ensemble uses too.

    `slenderness_percent` is a change of the angle alpha at the same diagonal, `size_percent` one of the diagonal at
    the same angle: the frequency parameter p goes with its root.
    """

    futures: Annotated[int, Field(ge=1, le=1_000_000)] | None = None
    seed: Annotated[int, Field(ge=0)] | None = None
    restitution: SpreadPart | None = None
    slenderness_percent: SpreadPart | None = None
    initial_tilt_deg: SpreadPart | None = None
    size_percent: SpreadPart = spread(0.5)
    table: TableUncertaintyPart = TableUncertaintyPart()

    def filled(self, twin: TwinPart) -> KnownUncertainty:
        """Return the same with `[twin]`'s values where there are none."""
        return KnownUncertainty(
            futures=twin.futures if self.futures is None else self.futures,
            asked=self.futures is not None or "futures" in twin.model_fields_set,
            seed=twin.seed if self.seed is None else self.seed,
            restitution=self.restitution or spread(twin.restitution_spread),
            slenderness_percent=self.slenderness_percent or spread(twin.slenderness_spread_percent),
            initial_tilt_deg=self.initial_tilt_deg or spread(twin.initial_tilt_spread_deg),
            size_percent=self.size_percent,
            table=self.table,
        )


class KnownUncertainty(Part):
    """`[uncertainty]` with nothing left out; `asked` where the scene itself says how many futures."""

    futures: int
    asked: bool
    seed: int
    restitution: SpreadPart
    slenderness_percent: SpreadPart
    initial_tilt_deg: SpreadPart
    size_percent: SpreadPart
    table: TableUncertaintyPart


UNCERTAINTY: dict[str, type[Part]] = {
    "uncertainty": UncertaintyPart,
    "restitution": SpreadPart,
    "slenderness_percent": SpreadPart,
    "initial_tilt_deg": SpreadPart,
    "size_percent": SpreadPart,
    "gain_percent": SpreadPart,
    "delay_ms": SpreadPart,
    "rebound": SpreadPart,
}
"""Tables by the name they have in a scene file; `[uncertainty.table]` is told from `[table]` by where it lies."""
