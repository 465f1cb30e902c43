"""Right, wrong quietly, or refused: a solver put through one situation where methods fail."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum

import numpy as np

from twin.chart.failures import Check, Quantity, Row
from twin.chart.solvers import STEP, Solver
from twin.chart.task import Answer, Task

SLACK = 3.0
"""A stated error is an estimate: an answer within three of it is right."""


class Verdict(Enum):
    """What became of one check."""

    RIGHT = "right"
    WRONG = "wrong quietly"
    REFUSED = "refused"
    NOT_APPLICABLE = "not applicable"


@dataclass(frozen=True, slots=True)
class Finding:
    """One solver in one situation.

    Attributes
    ----------
    row : Row
    solver : str
    verdict : Verdict
        WRONG where any check is, else REFUSED where any is, else RIGHT.
    right, wrong, refused : int
        Checks of each kind.
    detail : str
        The first check that was not right, in words.
    """

    row: Row
    solver: str
    verdict: Verdict
    right: int
    wrong: int
    refused: int
    detail: str


def examine(solver: Solver, row: Row) -> Finding:
    """Run a solver through every check of a row."""
    counts = dict.fromkeys(Verdict, 0)
    details: dict[Verdict, str] = {}
    # Checks of one run share its task object.
    answers: dict[tuple[int, float | None], Answer | str] = {}
    for check in row.checks:
        if not _applies(solver, check):
            continue
        key = (id(check.task), check.step)
        found = answers.get(key)
        if found is None:
            found = _answer(solver, check.task, check.step)
            answers[key] = found
        verdict, said = (Verdict.REFUSED, found) if isinstance(found, str) else judge(check, found, solver.relative)
        counts[verdict] += 1
        details.setdefault(verdict, f"{check.task.name}: {said}")
    worst = next(
        (v for v in (Verdict.WRONG, Verdict.REFUSED, Verdict.RIGHT) if counts[v]),
        Verdict.NOT_APPLICABLE,
    )
    detail = details.get(worst, "") if worst is not Verdict.RIGHT else ""
    return Finding(
        row, solver.name, worst, counts[Verdict.RIGHT], counts[Verdict.WRONG], counts[Verdict.REFUSED], detail
    )


def _applies(solver: Solver, check: Check) -> bool:
    if check.step is not None and solver.knob != STEP:
        return False
    if solver.relative > 0.0 and check.quantity is Quantity.ROTATION:
        return False  # a simpler model answers for its peak and its times
    return not (solver.peer and check.quantity in (Quantity.REST, Quantity.PEAK))


def _answer(solver: Solver, task: Task, step: float | None) -> Answer | str:
    try:
        return solver.run(task, step)
    except ValueError as error:
        return str(error)


def judge(check: Check, answer: Answer, relative: float = 0.0) -> tuple[Verdict, str]:
    """Return the verdict on one answer, and why in words.

    Parameters
    ----------
    check : Check
    answer : Answer
    relative : float
        Share of the answer a simpler model may be off.
    """
    expected = check.answer
    if check.quantity is Quantity.STAYS:
        stays = answer.uplift is None
        return (Verdict.RIGHT, "") if stays is expected else (Verdict.WRONG, "it lifts")
    if check.quantity is Quantity.RETURNS:
        return (Verdict.RIGHT, "") if answer.impacts.size else (Verdict.WRONG, "never comes back to the base")
    if check.quantity is Quantity.OVERTURNS:
        if answer.overturned is expected:
            return Verdict.RIGHT, ""
        if answer.overturned is None:
            return Verdict.REFUSED, "called undecided"
        said = "overturns" if answer.overturned else "stands"
        truth = "undecidable" if expected is None else "overturns" if expected else "stands"
        return Verdict.WRONG, f"{said}; truth: {truth}"
    value, rate = _value(check, answer)
    right = float(expected or 0.0)
    if value is None:
        if answer.overturned is None:
            return Verdict.REFUSED, "called undecided"
        return Verdict.WRONG, f"no {check.quantity.value}; truth: {right:.10g}"
    stated = SLACK * answer.stated
    if check.quantity in (Quantity.IMPACT, Quantity.REST, Quantity.OVERTURNING):
        # An error of the rotation is one of the time by the speed there.
        stated /= max(rate, 1e-12)
    allowed = max(check.tolerance, stated, relative * abs(right))
    if abs(value - right) <= allowed:
        return Verdict.RIGHT, ""
    wrong = Verdict.REFUSED if answer.overturned is None else Verdict.WRONG
    return wrong, f"{check.quantity.value} {value:.12g}; truth: {right:.12g}, stated within {allowed:.2g}"


def _value(check: Check, answer: Answer) -> tuple[float | None, float]:
    """Return the number looked at, and the speed that turns an error of the rotation into one of it."""
    rates = np.abs(answer.rates)
    fastest = float(np.max(rates)) if rates.size else math.inf
    index = check.which if check.which >= 0 else rates.size + check.which
    within = 0 <= index < rates.size
    match check.quantity:
        case Quantity.UPLIFT:
            return answer.uplift, 1.0
        case Quantity.REST:
            return answer.rest, float(np.median(rates)) if rates.size else fastest
        case Quantity.OVERTURNING:
            return answer.overturning, 1.0
        case Quantity.PEAK:
            return answer.peak, 1.0
        case Quantity.IMPACT:
            return (float(answer.impacts[index]), float(rates[index])) if within else (None, 1.0)
        case Quantity.RATE:
            return (float(rates[index]) if within else None), 1.0
        case _:
            known = check.at <= answer.end
            return (float(answer.rotation(np.array([check.at]))[0]) if known else None), 1.0
