"""Whether a verdict survives one rounding of every input: the last word on a doubtful outcome."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TypeAlias

from twin.rocking.compiled import FloatArray

ONE_ROUNDING = 2.0**-52

Verdict: TypeAlias = Callable[[FloatArray, FloatArray, float, float], bool]
"""(body, pieces, rotation, rate) -> whether the block overturns."""


def settled(
    verdict: bool, again: Verdict, body: FloatArray, pieces: FloatArray, rotation: float, rate: float
) -> bool | None:
    """Return the verdict if it survives one rounding of every input and another step length; None if it does not."""
    for changed, shaken, theta, omega in _neighbours(body, pieces, rotation, rate):
        if again(changed, shaken, theta, omega) is not verdict:
            return None
    return verdict


def _neighbours(
    body: FloatArray, pieces: FloatArray, rotation: float, rate: float
) -> Iterator[tuple[FloatArray, FloatArray, float, float]]:
    for stride in (0.71, 0.53, 0.37):
        changed = body.copy()
        changed[5] = 1e-16
        changed[6] = stride
        yield changed, pieces, rotation, rate
    for sign in (1.0, -1.0):
        factor = 1.0 + sign * ONE_ROUNDING
        for index in (0, 1, 3):  # alpha, p, eta
            changed = body.copy()
            changed[index] = min(changed[index] * factor, 1.0) if index == 3 else changed[index] * factor
            yield changed, pieces, rotation, rate
        louder = pieces.copy()
        louder[:, 2:5] *= factor
        slower = pieces.copy()
        slower[:, :2] *= factor
        slower[:, 3] /= factor
        slower[:, 5] /= factor
        yield body, louder, rotation, rate
        yield body, slower, rotation, rate
        if rotation != 0.0 or rate != 0.0:
            yield body, pieces, rotation * factor, rate * factor
