"""Tables of numbers in text files, as laboratories have them: any separator, decimal comma, lines of header."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from recordings.errors import RecordingError

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

LARGEST_FILE = 256 * 1024 * 1024
"""Bytes of a file above which it is refused unread."""
MOST_COLUMNS = 2000
LOOKED_AT = 400
"""Lines, from the first that has a number on, by which separator and decimal sign are found."""
SEPARATORS = {";": ";", "tab": "\t", ",": ",", "space": None}
"""By the name they have on the command line; None is any white space."""
MISSING = ("", "-", "--", "nan", "NaN", "NAN", "n/a", "N/A", "#N/A")
"""How a value that is not there is spelled."""

_NUMBER = re.compile(r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]{1,3})?")


@dataclass(frozen=True, eq=False)
class TextTable:
    """Columns of numbers.

    Attributes
    ----------
    names : tuple of tuple of str
        What each column is called: its texts in the lines above the numbers that have as many fields, the last first,
        and all of them in one, from above.
    values : ndarray, shape (rows, columns)
        NaN where a value is missing.
    lines : ndarray of int, shape (rows,)
        Number of each row's line in the file, from 1.
    """

    names: tuple[tuple[str, ...], ...]
    values: NDArray[np.float64]
    lines: NDArray[np.int64]


@dataclass(frozen=True)
class _Style:
    separator: str | None
    comma: bool

    def fields(self, line: str) -> list[str]:
        parts = line.split(self.separator)
        return [part.strip().strip('"').strip() for part in parts]

    def number(self, text: str) -> float | None:
        """Return the number of a field, NaN where it is missing, None where it is neither."""
        if text in MISSING:
            return math.nan
        if self.comma:
            if "." in text:
                return None
            text = text.replace(",", ".", 1)
        return float(text) if _NUMBER.fullmatch(text) else None

    def row(self, line: str, width: int | None = None) -> list[float] | None:
        """Return the numbers of a line; None where one of its fields is no number, or all are missing.

        Many programs end each line with a separator: where a line has one field more than `width`, or that is not known
        yet, an empty last one is none.
        """
        fields = self.fields(line)
        surplus = len(fields) > 1 if width is None else len(fields) == width + 1
        if surplus and fields[-1] == "" and self.separator is not None:
            fields.pop()
        numbers: list[float] = []
        for field in fields:
            number = self.number(field)
            if number is None:
                return None
            numbers.append(number)
        return numbers if any(map(math.isfinite, numbers)) else None


def read_text(path: Path) -> str:
    """Return a file's text, in UTF-8, UTF-16 with its mark, or Windows' western code page.

    Raises
    ------
    RecordingError
        It cannot be read, is too large, or is no text.
    """
    try:
        size = path.stat().st_size
        if size > LARGEST_FILE:
            raise RecordingError(f"{path} has {size / 2**20:.0f} MiB; the limit is {LARGEST_FILE // 2**20} MiB")
        data = path.read_bytes()
    except OSError as error:
        raise RecordingError(f"{path} cannot be read: {(error.strerror or str(error)).lower()}") from None
    coding = "utf-16" if data[:2] in (b"\xff\xfe", b"\xfe\xff") else "utf-8-sig"
    for attempt in (coding, "cp1252"):
        try:
            text = data.decode(attempt)
        except UnicodeDecodeError:
            continue
        if "\0" not in text:
            return text
    raise RecordingError(f"{path} is no text file")


def read_table(text: str, name: str, *, separator: str | None = None, decimal: str | None = None) -> TextTable:
    """Return the table in a text.

    Parameters
    ----------
    text : str
    name : str
        What the file is called, for the sentences.
    separator : str, optional
        A key of `SEPARATORS`; found out unless given: the one by which most lines are rows of numbers.
    decimal : {".", ","}, optional
        Found out with the separator unless given.

    Raises
    ------
    RecordingError
        One sentence with the number of the line: no table, rows of different length, a field that is no number.
    """
    lines = text.split("\n")
    style, width, first = _style(lines, name, separator, decimal)
    rows: list[list[float]] = []
    numbers: list[int] = []
    for number, line in enumerate(lines[first:], start=first + 1):
        if not line.strip() or line.lstrip().startswith("#"):
            continue
        row = style.row(line, width)
        if row is None:
            raise RecordingError(f"{name}, line {number}: {_reason(style, line)}")
        if len(row) != width:
            raise RecordingError(f"{name}, line {number}: {len(row)} fields, where the lines before have {width}")
        rows.append(row)
        numbers.append(number)
    return TextTable(
        _names(lines[:first], style, width),
        np.array(rows, dtype=np.float64).reshape(len(rows), width),
        np.array(numbers, dtype=np.int64),
    )


def _style(lines: list[str], name: str, separator: str | None, decimal: str | None) -> tuple[_Style, int, int]:
    """Return how numbers are written, how many stand in a row, and the index of the first row."""
    best: tuple[int, _Style, int, int] | None = None
    for key, mark in SEPARATORS.items():
        for comma in (False, True):
            if separator not in (None, key) or decimal not in (None, "," if comma else ".") or (comma and mark == ","):
                continue
            style = _Style(mark, comma)
            found = _rows(lines, style)
            if found is not None and (best is None or found[0] > best[0]):
                best = (found[0], style, *found[1:])
    if best is None:
        raise RecordingError(f"{name} has no table: no two lines of two or more numbers each")
    return best[1:]


def _rows(lines: list[str], style: _Style) -> tuple[int, int, int] | None:
    """Return how many of the first lines are rows, how wide those are, and where they begin; None where none do."""
    looked = 0
    widths: dict[int, tuple[int, int]] = {}
    for index, line in enumerate(lines):
        if not any(character.isdigit() for character in line[:10_000]):
            continue
        looked += 1
        if looked > LOOKED_AT:
            break
        row = style.row(line)
        if row is not None and 2 <= len(row) <= MOST_COLUMNS:
            count, first = widths.get(len(row), (0, index))
            widths[len(row)] = (count + 1, first)
    if not widths:
        return None
    width = max(widths, key=lambda key: widths[key][0])
    count, first = widths[width]
    return (count, width, first) if count >= 2 else None


def _names(lines: list[str], style: _Style, width: int) -> tuple[tuple[str, ...], ...]:
    heads: list[list[str]] = []
    for line in reversed(lines):
        for candidate in (style, _Style(";", comma=False), _Style("\t", comma=False), _Style(",", comma=False)):
            fields = candidate.fields(line.removeprefix("#"))
            if len(fields) == width + 1 and fields[-1] == "":
                fields.pop()
            if len(fields) == width and any(fields):
                heads.append(fields)
                break
    columns = [[head[k] for head in heads if head[k]] for k in range(width)]
    # Two lines of header often make one name: "Point 1" above "X".
    return tuple((*column, " ".join(reversed(column))) if len(column) > 1 else tuple(column) for column in columns)


def _reason(style: _Style, line: str) -> str:
    wrong = next((field for field in style.fields(line) if style.number(field) is None), None)
    if wrong is None:
        return "no number at all"
    sign = "comma" if style.comma else "point"
    return f"{wrong[:40]!r} is no number (with a decimal {sign})"
