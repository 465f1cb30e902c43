"""What a user can get wrong, said in one sentence."""

from __future__ import annotations

import difflib
from collections.abc import Callable, Iterable

from pydantic import ValidationError


class InputError(ValueError):
    """Input that cannot be used: one sentence saying what, where, the limit and its unit. The command exits with 2."""


def did_you_mean(name: str, known: Iterable[str]) -> str:
    """Return ", did you mean ..." or the whole list of known names, for the end of a sentence."""
    choices = sorted(known)
    close = difflib.get_close_matches(name, choices, n=1)
    return f"; did you mean {close[0]}?" if close else f"; known are {', '.join(choices)}"


def sentence(error: ValidationError, where: str, keys: Callable[[tuple[str | int, ...]], Iterable[str]]) -> str:
    """Return one fault of a pydantic error as one sentence: an unknown key before the key it was meant for.

    Parameters
    ----------
    error : ValidationError
    where : str
        What was read, e.g. the scene's name; it begins the sentence.
    keys : callable
        Place of an unknown key -> the keys known there, for the hint.
    """
    faults = error.errors(include_url=False)
    fault = next((fault for fault in faults if fault["type"] == "extra_forbidden"), faults[0])
    path = ".".join(str(part) for part in fault["loc"])
    place = f"{where}: {path}" if path else where
    value = fault["input"]
    shown = f" (given: {value!r:.60})" if isinstance(value, (int, float, str, bool)) else ""
    message = " ".join(fault["msg"].removeprefix("Value error, ").split())
    match fault["type"]:
        case "extra_forbidden":
            return f"{place} is not a key here{did_you_mean(str(fault['loc'][-1]), keys(fault['loc']))}"
        case "missing":
            return f"{place} is missing"
        case "union_tag_invalid" | "union_tag_not_found":
            return f"{place}: {message}"
        case _:
            return f"{place}: {message[:1].lower()}{message[1:]}{shown}"
