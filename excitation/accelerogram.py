"""Texts of measured accelerograms: PEER AT2 and CSV. Anything else is refused in one sentence (`ValueError`)."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Final

import numpy as np

from excitation.pieces import Array

# Two thousand seconds at 250 Hz; the longest strong-motion records have a tenth of it.
MAX_SAMPLES: Final = 500_000
MAX_CHARACTERS: Final = 64 * MAX_SAMPLES
# A header line beyond this belongs to no record, and would make the patterns below slow.
MAX_HEADER: Final = 1000
# Largest relative difference between a time step of a CSV record and its median.
STEP_TOLERANCE: Final = 1e-3

_NUMBER = r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[EeDd][+-]?[0-9]{1,4})?"
_FULL_NUMBER = re.compile(_NUMBER)
_COUNT_FIRST = re.compile(rf"\s*([0-9]{{1,9}})\s+({_NUMBER})\s+NPTS\s*,\s*DT\b", re.IGNORECASE)
_NAME_FIRST = re.compile(rf"\s*NPTS\s*=\s*([0-9]{{1,9}})\s*,?\s*DT\s*=\s*({_NUMBER})(?![^\s,])", re.IGNORECASE)
_UNITS = re.compile(r"\bUNITS?\s+OF\s+\(?([^\s,;:.()]+)", re.IGNORECASE)


@dataclass(frozen=True, slots=True)
class Accelerogram:
    """Samples of acceleration, in m/s2 or in g as `in_g` says, at equal steps of `time_step` (s), and their name."""

    samples: Array
    time_step: float
    name: str
    in_g: bool


def parse_at2(text: str) -> Accelerogram:
    """Return the record in a PEER AT2 text: four header lines, then the samples in g, several to a line.

    The third line must state units of G; the fourth gives the number of samples and the step, as "4096 0.0100 NPTS, DT"
    or "NPTS= 4096, DT= .0100 SEC". The second line names the record.

    Raises
    ------
    ValueError
        One sentence: not an AT2 text, other units, a value that is no finite number, more or fewer samples than stated.
    """
    lines = _lines(text, "AT2")
    if len(lines) < 4:
        raise ValueError(f"the AT2 text ends after {len(lines)} of its 4 header lines")
    if any(len(line) > MAX_HEADER for line in lines[:4]):
        raise ValueError(f"an AT2 header line has at most {MAX_HEADER} characters; this is no AT2 text")
    units = _UNITS.search(lines[2])
    if units is None:
        raise ValueError("line 3 of the AT2 text does not state its units; it must say UNITS OF G")
    if units[1].upper() != "G":
        raise ValueError(f"line 3 of the AT2 text states units of {units[1][:20]!r}; it must say UNITS OF G")
    found = _COUNT_FIRST.match(lines[3]) or _NAME_FIRST.match(lines[3])
    if found is None:
        raise ValueError("line 4 of the AT2 text does not state NPTS and DT")
    declared, time_step = int(found[1]), _number(found[2], "DT in line 4 of the AT2 text")
    if time_step <= 0.0:
        raise ValueError(f"line 4 of the AT2 text states a step of {time_step:g} s; it must be above 0 s")
    values = [
        _number(token, f"line {number} of the AT2 text")
        for number, line in enumerate(lines[4:], start=5)
        for token in line.split()
    ]
    if len(values) != declared:
        raise ValueError(f"the AT2 text declares {declared} samples, holds {len(values)}")
    return Accelerogram(np.array(values), time_step, _printable(lines[1]) or "record", in_g=True)


def parse_csv(text: str) -> Accelerogram:
    """Return the record in a CSV text with the columns `time_s` and `acceleration_m_s2` or `acceleration_g`.

    The first line that is neither empty nor a comment ("#") names the columns, separated by commas or semicolons;
    others than these two are ignored. Times may start anywhere and must be evenly spaced to `STEP_TOLERANCE`.

    Raises
    ------
    ValueError
        One sentence: a missing or doubled column, a value that is no finite number, a missing sample.
    """
    lines = [
        (number, line)
        for number, line in enumerate(_lines(text, "CSV"), start=1)
        if line.strip() and not line.lstrip().startswith("#")
    ]
    if not lines:
        raise ValueError("the CSV text holds neither a header nor samples")
    header = lines[0][1]
    separator = ";" if ";" in header else ","
    names = _fields(header, separator)
    time, value = _column(names, ("time_s",)), _column(names, ("acceleration_m_s2", "acceleration_g"))
    rows: list[tuple[float, float]] = []
    for number, line in lines[1:]:
        fields = _fields(line, separator)
        if len(fields) != len(names):
            raise ValueError(
                f"line {number} of the CSV text has {len(fields)} fields; its header names {len(names)} columns"
            )
        where = f"line {number} of the CSV text"
        rows.append((_number(fields[time], where), _number(fields[value], where)))
    if len(rows) < 2:
        raise ValueError(f"the CSV text holds {len(rows)} samples; a record needs at least 2")
    times, samples = np.array(rows).T
    return Accelerogram(samples, _even_step(times, [n for n, _ in lines[1:]]), "record", names[value].endswith("_g"))


def _lines(text: object, form: str) -> list[str]:
    if not isinstance(text, str):
        raise ValueError(f"the {form} text must be text, not {type(text).__name__}")
    if len(text) > MAX_CHARACTERS:
        raise ValueError(f"the {form} text has {len(text)} characters; the limit is {MAX_CHARACTERS}")
    # Old files end in the end-of-file mark of DOS, new ones may begin with a byte-order mark.
    text = text.removeprefix("\ufeff").rstrip("\x1a \t\r\n")
    return text.replace("\r\n", "\n").replace("\r", "\n").split("\n")


def _number(token: str, where: str) -> float:
    if _FULL_NUMBER.fullmatch(token) is None:
        raise ValueError(f"{where} has {_printable(token)!r}, which is not one finite number")
    number = float(token.upper().replace("D", "E"))
    if not np.isfinite(number):
        raise ValueError(f"{where} has {_printable(token)!r}, which is too large a number")
    return number


def _printable(text: str) -> str:
    """Return at most 80 characters of `text` on one line, without control characters."""
    kept = "".join(c if c.isprintable() else " " for c in text[:200])
    return " ".join(kept.split())[:80]


def _fields(line: str, separator: str) -> list[str]:
    return [field.strip().strip('"').strip() for field in line.split(separator)]


def _column(names: list[str], wanted: tuple[str, ...]) -> int:
    found = [index for index, name in enumerate(names) if name in wanted]
    if len(found) != 1:
        number = "no" if not found else "more than one"
        raise ValueError(f"the header of the CSV text names {number} column {' or '.join(wanted)}")
    return found[0]


def _even_step(times: Array, lines: list[int]) -> float:
    with np.errstate(over="ignore", invalid="ignore"):
        steps = np.diff(times)
        step = float(np.median(steps))
        if not 0.0 < step < np.inf:
            raise ValueError(f"the times of the CSV text do not increase: the median step is {step:g} s")
        uneven = np.flatnonzero(~(np.abs(steps - step) <= STEP_TOLERANCE * step))
    if len(uneven):
        first = int(uneven[0])
        here = f"between {times[first]:.9g} s and {times[first + 1]:.9g} s (line {lines[first + 1]})"
        missing = round(steps[first] / step) - 1 if np.isfinite(steps[first] / step) else 0
        if missing >= 1 and abs(steps[first] - (missing + 1) * step) <= 0.1 * step:
            samples = "a sample is" if missing == 1 else f"{missing} samples are"
            raise ValueError(f"{samples} missing from the CSV text {here}; its step is {step:.9g} s")
        raise ValueError(f"the time step of the CSV text changes {here} from {step:.9g} s to {steps[first]:.9g} s")
    return float((times[-1] - times[0]) / len(steps))
