"""The tables of `forecast_chain`, counted from its rows."""

from __future__ import annotations

import itertools
import json
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from tests.benchmarks.chain_scenes import KINDS
from tests.benchmarks.forecast_study import ADVICES

Row = dict[str, str]
WAYS = ("with", "without")
CASES = ((True, False), (False, True), (True, True), (False, False))
"""Whether the block falls if the run goes on, and if it is stopped."""
RIGHT = {
    "continue": ((False, True), (False, False)),
    "stopping helps": ((True, False),),
    "stopping would topple it": ((False, True),),
    "too late": ((True, True),),
}
"""Where an advice was right. "neither" beside "stopping helps": the stop did no harm, but was not needed."""


def report(rows: Sequence[Row]) -> None:
    """Print all tables."""
    print(
        "| excitation | observer | runs | fell | foreseen | missed | false alarms | s before pi/2 | "
        "s before the last stop that saves | alarms too late to save | instants right |"
    )
    print("|" + "---|" * 11)
    for kind in (*KINDS, "all"):
        for way in WAYS:
            print(outcome_row(kind, way, _of(rows, kind, way)))
    print("\nThe same with what the plan alone says before the pulse (the trip of the scene, latched once):\n")
    print("| observer | fell | foreseen | false alarms | of them before the pulse |\n|" + "---|" * 5)
    for way in WAYS:
        print(whole_row(way, _of(rows, "all", way)))
    _advice("advice at the first alarm", rows, alarm_cases)
    _advice("advice, first given", rows, first_cases)
    _advice("advice, at random instants", rows, random_cases)
    _reliability(rows)
    _checks(rows)


def number(text: str) -> float | None:
    """Return a cell's number; None where it is empty."""
    return float(text) if text else None


def outcome_row(kind: str, way: str, rows: Sequence[Row]) -> str:
    """Return the row of one kind of excitation."""
    fell = [row for row in rows if row["fell_s"]]
    alarms = [row for row in rows if row["alarm_in_pulse_s"]]
    right = [row for row in alarms if row["fell_s"]]
    early = [float(row["fell_s"]) - float(row["alarm_in_pulse_s"]) for row in right]
    saved = [float(row["no_return_s"]) - float(row["alarm_in_pulse_s"]) for row in right if row["no_return_s"]]
    late = sum(lead < 0.0 for lead in saved) + sum(not row["no_return_s"] for row in right)
    instants = sum(int(row["right"]) for row in rows) / max(1, sum(int(row["instants"]) for row in rows))
    counts = (len(rows), len(fell), len(right), len(fell) - len(right), len(alarms) - len(right))
    return (
        f"| {kind} | {way} | {' | '.join(map(str, counts))} | {spread(early)} | {spread(saved)} | {late} | "
        f"{100 * instants:.1f} % |"
    )


def whole_row(way: str, rows: Sequence[Row]) -> str:
    """Return the row that counts alarms from the first cycle on."""
    alarms = [row for row in rows if row["alarm_s"]]
    wrong = [row for row in alarms if not row["fell_s"]]
    before = sum(float(row["alarm_s"]) < float(row["pulse_s"]) for row in wrong)
    fell = sum(bool(row["fell_s"]) for row in rows)
    return f"| {way} | {fell} | {len(alarms) - len(wrong)} | {len(wrong)} | {before} |"


def alarm_cases(row: Row) -> list[tuple[str, bool]]:
    """Return the advice given with the alarm, and whether a stop there fells the block."""
    said: list[Any] | None = json.loads(row["alarm_stop"])
    return [] if said is None or said[1] is None else [(said[0], said[1])]


def first_cases(row: Row) -> list[tuple[str, bool]]:
    """Return each advice where it was first given."""
    return [(advice, stop) for advice, _, stop in json.loads(row["first"]) if stop is not None]


def random_cases(row: Row) -> list[tuple[str, bool]]:
    """Return the advice at each random instant."""
    return [(advice, stop) for advice, _, stop in json.loads(row["random"])]


def advice_row(advice: str, way: str, rows: Sequence[Row], cases: Callable[[Row], list[tuple[str, bool]]]) -> str:
    """Return how often each of the four cases was there when `advice` was given."""
    found = [(bool(row["fell_s"]), stop) for row in rows for said, stop in cases(row) if said == advice]
    counts = " | ".join(str(found.count(case)) for case in CASES)
    right = sum(found.count(case) for case in RIGHT.get(advice, ()))
    share = f"{100.0 * right / len(found):.0f} %" if advice in RIGHT and found else "-"
    return f"| {advice} | {way} | {len(found)} | {counts} | {share} |"


def spread(values: Sequence[float]) -> str:
    """Return the median and, in brackets, the 10th percentile."""
    if not values:
        return "-"
    low, middle = np.percentile(values, [10, 50])
    return f"{middle:.2f} ({low:.2f})"


def _advice(title: str, rows: Sequence[Row], cases: Callable[[Row], list[tuple[str, bool]]]) -> None:
    print(f"\n| {title} | observer | times | only going on falls | only stopping falls | both | neither | right |")
    print("|" + "---|" * 8)
    for advice in ADVICES:
        for way in WAYS:
            print(advice_row(advice, way, _of(rows, "all", way), cases))


def _reliability(rows: Sequence[Row]) -> None:
    print("\n| probability of falling, at random instants | with observer: times, fell | without: times, fell |")
    print("|---|---|---|")
    for low, high in itertools.pairwise((0.0, 0.05, 0.25, 0.75, 0.95, 1.01)):
        cells: list[str] = []
        for way in WAYS:
            fell = [
                bool(row["fell_s"])
                for row in _of(rows, "all", way)
                for _, share, _ in json.loads(row["random"])
                if low <= share < high
            ]
            cells.append(f"{len(fell)}, {100.0 * np.mean(fell):.0f} %" if fell else "0")
        print(f"| {low:.2f} to {min(high, 1.0):.2f} | {cells[0]} | {cells[1]} |")


def _checks(rows: Sequence[Row]) -> None:
    again = [json.loads(row["repeated"]) for row in _of(rows, "all", "with")]
    made = [one for one in again if one is not None]
    same = sum(one[1] == one[2] for one in made)
    cycles = sum(int(row["cycles"]) for row in rows)
    cpu = sum(float(row["cpu_s"]) for row in _of(rows, "all", "with"))
    print(f"\nStops made again from the beginning of the run: {len(made)}, of the same end {same}.")
    print(f"{len(rows) // 2} scenes, {cycles} cycles; {cpu:.0f} s of processor time, with all stops.")


def _of(rows: Sequence[Row], kind: str, way: str) -> list[Row]:
    return [row for row in rows if kind in ("all", row["kind"]) and row["forecast"] == way]
