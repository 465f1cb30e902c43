"""What a run is wanted for, read from an operator's words: forgiving in how it is said, never in what is meant."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, replace
from enum import Enum

from twin.errors import InputError

LIMIT = 0.01
"""Probability of overturning below which a run counts as safe, unless told."""


class Aim(Enum):
    """What a run can be wanted for; the value is the name it goes by."""

    OVERTURN = "overturn"
    NO_IMPACT = "overturn without impact"
    SAFE = "largest safe amplitude"
    ROCK = "rock without overturning"
    SEPARATE = "separate restitution"


@dataclass(frozen=True, slots=True)
class Goal:
    """An aim, with what the words said beside it.

    `limit` is the probability of overturning below which a run is safe; `at` the frequency asked for, Hz, None for that
    of the scene.
    """

    aim: Aim
    limit: float = LIMIT
    at: float | None = None


_WORDS = {
    **dict.fromkeys(
        ("overturn", "overturns", "overturned", "overturning", "topple", "topples", "toppling"), "overturn"
    ),
    **dict.fromkeys(("fall", "falls", "falling", "fell", "collapse"), "overturn"),
    **dict.fromkeys(("without", "no", "not", "zero", "never", "dont", "doesnt"), "without"),
    **dict.fromkeys(("impact", "impacts", "bounce", "bounces", "strike"), "impact"),
    **dict.fromkeys(("largest", "biggest", "highest", "greatest", "maximum", "max", "most"), "largest"),
    **dict.fromkeys(("safe", "safest", "safely"), "safe"),
    **dict.fromkeys(("amplitude", "amplitudes", "acceleration"), "amplitude"),
    **dict.fromkeys(("rock", "rocks", "rocking", "rotate", "rotation", "uplift"), "rock"),
    **dict.fromkeys(
        ("separate", "separates", "distinguish", "discriminate", "tell", "compare", "identify"), "separate"
    ),
    **dict.fromkeys(("restitution", "eta", "restitutions"), "restitution"),
    **dict.fromkeys(("housner", "housners"), "restitution"),
    "measured": "restitution",
}
_FILLERS = frozenset(
    {"a", "an", "the", "of", "for", "with", "and", "or", "to", "that", "s", "run", "runs", "find", "me", "its", "it"}
    | {"is", "this", "probability", "chance", "below", "under", "less", "than", "at", "from", "block"}
    | {"which", "by", "best", "apart", "does", "do", "but", "any"}
)
_MEANINGS = {
    frozenset({"overturn"}): Aim.OVERTURN,
    frozenset({"overturn", "without", "impact"}): Aim.NO_IMPACT,
    frozenset({"largest", "safe", "amplitude"}): Aim.SAFE,
    frozenset({"safe", "amplitude"}): Aim.SAFE,
    frozenset({"largest", "safe"}): Aim.SAFE,
    frozenset({"rock", "without", "overturn"}): Aim.ROCK,
    frozenset({"largest", "rock", "without", "overturn"}): Aim.ROCK,
    frozenset({"largest", "safe", "rock"}): Aim.ROCK,
    frozenset({"safe", "rock"}): Aim.ROCK,
    frozenset({"separate", "restitution"}): Aim.SEPARATE,
}
# Any order of the words of a goal means the same, but for these.
_ORDERED = {
    Aim.NO_IMPACT: re.compile(r"overturn without impact|without impact overturn"),
    Aim.ROCK: re.compile(r"(largest )?(safe )?rock( safe)?( without overturn)?|without overturn (largest )?rock"),
}
_SHARE = re.compile(r"([-+]?(?:\d+(?:\.\d*)?|\.\d+))\s*(?:%|per\s?cent\b)")
_FREQUENCY = re.compile(r"(?:\bat\s+)?([-+]?(?:\d+(?:\.\d*)?|\.\d+))\s*hz\b")
_HERE = re.compile(r"\b(?:at|of|for)[\s_-]+(?:this|the|its|that|a|the[\s_-]+same|scenes)?[\s_-]*frequency\b")


def read_goal(text: str) -> Goal:
    """Return the goal that `text` names.

    Case, order, small words and usual synonyms do not matter; "N %" is the probability below which a run is safe and
    "at N Hz" a frequency. A word or number that is none of these is an error, not a guess.

    Raises
    ------
    InputError
        One sentence that lists the goals.

    Examples
    --------
    >>> read_goal("Largest safe amplitude at 3.2 Hz with probability below 2 %")
    Goal(aim=<Aim.SAFE: 'largest safe amplitude'>, limit=0.02, at=3.2)
    >>> read_goal("topple with no impacts").aim.value
    'overturn without impact'
    """
    rest = text.lower().replace("'", "").replace("’", "")
    rest, shares = _taken(_SHARE, rest)
    rest, frequencies = _taken(_FREQUENCY, rest)
    rest = _HERE.sub(" ", rest)
    names = [name for name in re.split(r"[\s,;:()_\-–]+", rest.strip(' .!?"')) if name and name not in _FILLERS]
    unknown = next((name for name in names if name not in _WORDS), None)
    words = [_WORDS.get(name, name) for name in names]
    aim = _MEANINGS.get(frozenset(words))
    order = None if aim is None else _ORDERED.get(aim)
    if unknown is not None or aim is None or (order is not None and not order.fullmatch(" ".join(_once(words)))):
        why = f" (what is {unknown!r:.40}?)" if unknown is not None and names != [unknown] else ""
        raise InputError(f"--find {text!r:.80} is no goal{why}; goals are: {known_goals()}")
    if len(shares) > 1 or len(frequencies) > 1:
        raise InputError(f"--find {text!r:.80} says {'two shares' if len(shares) > 1 else 'two frequencies'}; give one")
    return _with_numbers(Goal(aim), text, shares, frequencies)


def known_goals() -> str:
    """Return the goals in words, for a sentence."""
    return ", ".join(f'"{aim.value}"' for aim in Aim)


def _with_numbers(goal: Goal, text: str, shares: list[float], frequencies: list[float]) -> Goal:
    if shares:
        if goal.aim not in (Aim.SAFE, Aim.ROCK):
            raise InputError(f"--find {text!r:.80}: a probability belongs to {Aim.SAFE.value} or {Aim.ROCK.value}")
        if not 0.1 <= shares[0] <= 50.0:
            raise InputError(
                f"--find {text!r:.80}: the probability is {shares[0]:g} %; it must be above 0 and at most 50"
            )
        goal = replace(goal, limit=shares[0] / 100.0)
    if frequencies:
        if not 0.0 < frequencies[0] < math.inf:
            raise InputError(f"--find {text!r:.80}: the frequency is {frequencies[0]:g} Hz; it must be above 0")
        goal = replace(goal, at=frequencies[0])
    return goal


def _taken(pattern: re.Pattern[str], text: str) -> tuple[str, list[float]]:
    return pattern.sub(" ", text), [float(number) for number in pattern.findall(text)]


def _once(words: list[str]) -> list[str]:
    """Return the words without repetitions in a row."""
    return [word for k, word in enumerate(words) if k == 0 or word != words[k - 1]]
