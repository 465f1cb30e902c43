"""Checked numbers: every refused value is one sentence with its name, value, limit and unit."""

from __future__ import annotations

import math
from numbers import Real
from typing import Final

from pydantic import BeforeValidator, ConfigDict, ValidationInfo
from pydantic_core import PydanticCustomError

# Far beyond any table, and small enough that no square or product of two of them overflows.
LARGEST: Final = 1e6

# A value that must be above 0 is at least this, so that no quotient overflows.
SMALLEST: Final = 1e-9

VALUE: Final = ConfigDict(
    strict=True, allow_inf_nan=False, extra="forbid", arbitrary_types_allowed=True, populate_by_name=True
)


def refusal(sentence: str) -> PydanticCustomError:
    """Return the error that makes `sentence`, and nothing else, the message of a `pydantic.ValidationError`."""
    return PydanticCustomError("excitation", "{sentence}", {"sentence": sentence})


def checked(
    name: str,
    value: object,
    unit: str = "",
    *,
    above: float | None = None,
    at_least: float = -LARGEST,
    at_most: float = LARGEST,
) -> float:
    """Return `value` as a float, or raise one sentence.

    Parameters
    ----------
    name, unit : str
        What the sentence calls the value, and its unit ("" for a pure number).
    value : object
        Any real number; bool, text, NaN and infinity are refused.
    above, at_least, at_most : float
        Bounds in `unit`; `above` is exclusive and takes the place of `at_least` (above 0 is `SMALLEST` or more).

    Raises
    ------
    ValueError
        Not a number, not finite, or outside the bounds.

    Examples
    --------
    >>> checked("frequency", -1, "Hz", above=0.0)
    Traceback (most recent call last):
    ...
    ValueError: frequency is -1 Hz; it must be above 0 Hz
    """
    unit = f" {unit}" if unit else ""
    if isinstance(value, bool) or not isinstance(value, Real):
        raise ValueError(f"{name} must be a number, not {type(value).__name__}")
    try:
        number = float(value)
    except OverflowError:
        number = math.inf
    if not math.isfinite(number):
        raise ValueError(f"{name} is {number}; it must be finite")
    if above is not None and not number > above:
        raise ValueError(f"{name} is {number:.6g}{unit}; it must be above {above:g}{unit}")
    least = at_least if above is None else above + SMALLEST
    if number < least:
        raise ValueError(f"{name} is {number:.6g}{unit}; it must be at least {least:g}{unit}")
    if number > at_most:
        raise ValueError(f"{name} is {number:.6g}{unit}; it must be at most {at_most:g}{unit}")
    return number


def quantity(
    unit: str = "",
    *,
    name: str | None = None,
    above: float | None = None,
    at_least: float = -LARGEST,
    at_most: float = LARGEST,
) -> BeforeValidator:
    """Return the validator of a field in `unit`: `Annotated[float, quantity("Hz", above=0.0)]`; see `checked`.

    Messages use the field's name unless told another.
    """

    def validate(value: object, info: ValidationInfo) -> float:
        try:
            return checked(
                name or info.field_name or "value", value, unit, above=above, at_least=at_least, at_most=at_most
            )
        except ValueError as error:
            raise refusal(str(error)) from None

    return BeforeValidator(validate)
