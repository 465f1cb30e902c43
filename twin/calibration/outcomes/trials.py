"""Trials of overturning: what the base was told, and whether the block fell; read from a table (CSV)."""

from __future__ import annotations

import csv
import math
from collections.abc import Iterator
from dataclasses import dataclass

from excitation import CosineWave, SineWave
from twin.errors import InputError, did_you_mean

SINE, COSINE = KINDS = ("sine", "cosine")
FALLEN = "overturned"
MARK = "#"
AMPLITUDES = ("amplitude_g", "amplitude_m_s2")
COLUMNS = ("kind", *AMPLITUDES, "frequency_hz", "cycles", FALLEN)
ANSWERS = {"yes": True, "1": True, "true": True, "no": False, "0": False, "false": False}
MOST_TRIALS = 10_000
MOST_CYCLES = 100.0
"""Of one trial: each is followed thousands of times."""
HIGHEST_FREQUENCY = 1000.0
"""Hz; no table shakes a block faster."""


@dataclass(frozen=True, slots=True)
class Trial:
    """One run: a wave of base acceleration and whether the block fell.

    Attributes
    ----------
    kind : str
        "sine" or "cosine".
    amplitude : float
        m/s2; its sign is the sense of the first half cycle.
    frequency : float
        Hz.
    cycles : float
        Length in cycles.
    overturned : bool
        Whether the block lay on its side in the end.
    """

    kind: str
    amplitude: float
    frequency: float
    overturned: bool
    cycles: float = 1.0

    def wave(self) -> SineWave | CosineWave:
        """Return the base motion."""
        wave = SineWave if self.kind == SINE else CosineWave
        return wave(self.amplitude, self.frequency, self.cycles)


def names_outcomes(text: str) -> bool:
    """Tell whether a text is a table of outcomes: its header names a column `overturned`."""
    for line in text.removeprefix("\ufeff").splitlines():
        if line.strip() and not line.lstrip().startswith(MARK):
            return FALLEN in _fields(line, _separator(line))
    return False


def read_trials(text: str, *, gravity: float = 9.81) -> tuple[Trial, ...]:
    """Return the trials of a CSV text.

    The first line that is neither empty nor a comment ("#") names the columns, separated by commas or semicolons:
    `kind` (sine, cosine), `amplitude_g` or `amplitude_m_s2`, `frequency_hz`, `overturned` (yes, no, 1, 0, true, false)
    and, where it is not one, `cycles`. Columns of other names are left alone.

    Parameters
    ----------
    text : str
    gravity : float
        1 g in m/s2.

    Raises
    ------
    InputError
        One sentence with the number of the line: a column missing or doubled, a number missing, not finite or out of
        its range, a word that is neither yes nor no.

    Examples
    --------
    >>> trials = read_trials("kind,amplitude_g,frequency_hz,overturned\\ncosine,0.5,2,yes", gravity=10.0)
    >>> trials[0].amplitude, trials[0].overturned
    (5.0, True)
    """
    lines = _lines(text)
    first = next(lines, None)
    if first is None:
        raise InputError("the table of outcomes is empty")
    separator = _separator(first[1])
    names = _fields(first[1], separator)
    places = _places(names)
    trials: list[Trial] = []
    for number, line in lines:
        if len(trials) == MOST_TRIALS:
            raise InputError(f"line {number} is past the {MOST_TRIALS} trials that a table of outcomes may have")
        fields = _fields(line, separator)
        if len(fields) != len(names):
            raise InputError(f"line {number} has {len(fields)} fields; the header names {len(names)} columns")
        trials.append(_trial({name: fields[place] for name, place in places.items()}, number, gravity))
    if not trials:
        raise InputError("the table of outcomes has a header and no trials")
    return tuple(trials)


def _trial(row: dict[str, str], number: int, gravity: float) -> Trial:
    kind = row["kind"].lower()
    if kind not in KINDS:
        raise InputError(f"line {number}: kind is {_shown(row['kind'])}{did_you_mean(kind[:40], KINDS)}")
    name = next(name for name in AMPLITUDES if name in row)
    amplitude = _number(row[name], name, number) * (gravity if name == AMPLITUDES[0] else 1.0)
    if not 0.0 < abs(amplitude) <= 1e4:
        raise InputError(f"line {number}: {name} is {_shown(row[name])}; it must not be 0, nor above 1e4 m/s2")
    frequency = _number(row["frequency_hz"], "frequency_hz", number)
    if not 1e-3 <= frequency <= HIGHEST_FREQUENCY:
        raise InputError(
            f"line {number}: frequency_hz is {_shown(row['frequency_hz'])}; it must be 0.001 to {HIGHEST_FREQUENCY:g}"
        )
    cycles = _number(row["cycles"], "cycles", number) if row.get("cycles") else 1.0
    if not 1e-3 <= cycles <= MOST_CYCLES:
        raise InputError(f"line {number}: cycles is {_shown(row['cycles'])}; it must be 0.001 to {MOST_CYCLES:g}")
    answer = ANSWERS.get(row[FALLEN].lower())
    if answer is None:
        raise InputError(f"line {number}: {FALLEN} is {_shown(row[FALLEN])}; it is yes or no (or 1, 0, true, false)")
    return Trial(kind, amplitude, frequency, answer, cycles)


def _places(names: list[str]) -> dict[str, int]:
    """Return where each column stands."""
    places: dict[str, int] = {}
    for place, name in enumerate(names):
        if name in places:
            raise InputError(f"the header names the column {name} twice")
        if name in COLUMNS:
            places[name] = place
    if len([name for name in AMPLITUDES if name in places]) != 1:
        how = "both" if AMPLITUDES[0] in places else "neither"
        raise InputError(f"the header names {how} of {AMPLITUDES[0]} and {AMPLITUDES[1]}; give the one you measured in")
    for name in ("kind", "frequency_hz", FALLEN):
        if name not in places:
            raise InputError(f"the header names no column {name}; a table of outcomes has {', '.join(COLUMNS)}")
    return places


def _number(word: str, name: str, number: int) -> float:
    try:
        value = float(word)
    except ValueError:
        raise InputError(f"line {number}: {name} is {_shown(word)}, which is no number") from None
    if not math.isfinite(value):
        raise InputError(f"line {number}: {name} is {_shown(word)}; it must be finite")
    return value


def _lines(text: str) -> Iterator[tuple[int, str]]:
    for number, line in enumerate(text.removeprefix("\ufeff").splitlines(), start=1):
        if line.strip() and not line.lstrip().startswith(MARK):
            yield number, line


def _separator(line: str) -> str:
    return ";" if ";" in line else ","


def _fields(line: str, separator: str) -> list[str]:
    try:
        row: list[str] = next(csv.reader([line], delimiter=separator))
    except csv.Error:
        row = line.split(separator)
    return [field.strip() for field in row]


def _shown(word: str) -> str:
    """Return at most 40 characters of a word in quotes, without control characters."""
    return repr("".join(c if c.isprintable() else " " for c in word[:40]))
