"""Text of a known width: what the page's type can show, how wide it is, and where a line breaks."""

from __future__ import annotations

import unicodedata
from collections.abc import Callable
from functools import cache
from typing import Any

SANS, MONO = "DejaVu Sans", "DejaVu Sans Mono"
"""Both come with matplotlib: a page looks the same everywhere."""
UNIT = 1000.0
HINTED = 1.03
"""A picture's pixels make letters wider than their outlines, by up to this."""
MISSING = "\N{WHITE SQUARE}"
"""Stands for a character the type does not have."""


def printable(text: str, family: str = SANS) -> str:
    """Return `text` in one line, of characters the type has: a page is set from what users wrote.

    Examples
    --------
    >>> printable("a\\tb\\x00c \\u9707")
    'a b c □'
    """
    known = _characters(family)
    shown = "".join(_shown(character, known) for character in text)
    return " ".join(shown.split())


def _shown(character: str, known: frozenset[int]) -> str:
    kind = unicodedata.category(character)
    if kind[0] in "CZ":
        # Controls, marks of direction, halves of surrogate pairs, every sort of space.
        return " "
    return character if ord(character) in known else MISSING


@cache
def _type(family: str, weight: str) -> Any:
    """Return the type itself, of a size of 1000 points."""
    from matplotlib import font_manager
    from matplotlib.ft2font import FT2Font

    fonts: Any = font_manager
    found: Any = FT2Font(fonts.findfont(fonts.FontProperties(family=family, weight=weight)))
    found.set_size(UNIT, 72.0)
    return found


@cache
def _characters(family: str) -> frozenset[int]:
    return frozenset(_type(family, "normal").get_charmap())


@cache
def _advance(character: str, family: str, weight: str) -> float:
    """Return how far a character moves the next one on, as a share of the size."""
    from matplotlib.ft2font import LoadFlags

    glyph = _type(family, weight).load_char(ord(character), flags=LoadFlags.NO_HINTING)
    return float(glyph.linearHoriAdvance) / 65536.0 / UNIT


def width_of(text: str, size: float, family: str = SANS, weight: str = "normal") -> float:
    """Return how wide a line is at most, in points: its letters side by side, kerning left out."""
    return HINTED * size * sum(_advance(character, family, weight) for character in text)


def wrapped(text: str, width: float, size: float, family: str = SANS, weight: str = "normal") -> list[str]:
    """Return `text` in lines no wider than `width`, points; a word that is wider than that is broken.

    Examples
    --------
    >>> wrapped("shake the table", 40.0, 8.0)
    ['shake', 'the table']
    """

    def fits(line: str) -> bool:
        return width_of(line, size, family, weight) <= width

    lines: list[str] = []
    line = ""
    for word in printable(text, family).split(" "):
        longer = f"{line} {word}" if line else word
        if fits(longer):
            line = longer
            continue
        if line:
            lines.append(line)
        rest = word
        while not fits(rest) and len(rest) > 1:
            part = _longest(rest, fits)
            lines.append(rest[:part])
            rest = rest[part:]
        line = rest
    return [*lines, line] if line or not lines else lines


def shortened(text: str, width: float, size: float, family: str = SANS, weight: str = "normal") -> str:
    """Return `text` in one line no wider than `width`, points, with an ellipsis where its end had to go."""
    shown = printable(text, family)
    if width_of(shown, size, family, weight) <= width:
        return shown

    def fits(line: str) -> bool:
        return width_of(f"{line}…", size, family, weight) <= width

    part = _longest(shown, fits)
    return f"{shown[:part].rstrip()}…"


def _longest(text: str, fits: Callable[[str], bool]) -> int:
    """Return how many characters of `text` fit, at least one: wider text is never narrower."""
    low, high = 1, len(text)
    while low < high:
        middle = (low + high + 1) // 2
        low, high = (middle, high) if fits(text[:middle]) else (low, middle - 1)
    return low
