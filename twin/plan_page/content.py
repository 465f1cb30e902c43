"""What stands on the page, whatever it is printed on: lines, tables and where they come from."""

from __future__ import annotations

from dataclasses import dataclass

from twin.plan import Plan
from twin.plan_page.origin import Origin, unknown_origin
from twin.plan_report import sentences
from twin.whole_run.check import WholeRun
from twin.whole_run.outcome import STANDS_EITHER_WAY, WORDS, Interval, StopStudy
from twin.whole_run.stops import Stop
from twin.whole_run.words import impact_words

HEAD = 11
"""Characters of a sentence's head."""
MOST_STRETCHES = 9
"""Rows of the table of stops, beyond those of the extremes."""


@dataclass(frozen=True, slots=True)
class Fact:
    """A line of the plan: its head, and what it says in one or several sentences."""

    head: str
    text: str


@dataclass(frozen=True, slots=True)
class Table:
    """Rows of words under the names of their columns, and what is to be said below."""

    title: str
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    note: str = ""


@dataclass(frozen=True, slots=True)
class Content:
    """The page's words.

    Attributes
    ----------
    name, title : str
        Of the scene, as its author wrote them.
    verdict : str
    warned : bool
        Whether the verdict is not plainly good.
    facts : tuple of Fact
        All other lines of the plan, in order.
    stops : Table or None
        What stopping does, stretch by stretch; None where nothing can be made, or nothing stops the machine.
    capacity : Table
        The table's numbers with their sources.
    reproduce : tuple of Fact
        Command, time, files, versions, seed.
    """

    name: str
    title: str
    verdict: str
    warned: bool
    facts: tuple[Fact, ...]
    stops: Table | None
    capacity: Table
    reproduce: tuple[Fact, ...]

    @property
    def texts(self) -> list[str]:
        """Every text of the page."""
        found = [self.name, self.title, self.verdict]
        for fact in (*self.facts, *self.reproduce):
            found += [fact.head, fact.text]
        for table in (self.stops, self.capacity):
            if table is not None:
                found += [table.title, *table.columns, *(cell for row in table.rows for cell in row), table.note]
        return found


def content_of(plan: Plan, origin: Origin | None = None) -> Content:
    """Return the words of the page of a plan."""
    facts = facts_of(sentences(plan))
    verdict = next((fact.text for fact in facts if fact.head == "verdict"), "")
    return Content(
        name=plan.scene.name,
        title=plan.scene.title,
        verdict=verdict,
        warned=not (plan.feasible and plan.stays_up),
        facts=tuple(fact for fact in facts if fact.head not in ("scene", "verdict")),
        stops=None if plan.whole_run is None else stop_table(plan.whole_run),
        capacity=capacity_table(plan),
        reproduce=_reproduce(plan, origin or unknown_origin()),
    )


def facts_of(lines: list[str]) -> list[Fact]:
    """Return sentences by their heads; a line without a head goes on with the one before."""
    facts: list[Fact] = []
    for line in lines:
        head, text = line[:HEAD].strip(), line[HEAD:].strip()
        if head or not facts:
            facts.append(Fact(head, text))
        else:
            facts[-1] = Fact(facts[-1].head, f"{facts[-1].text}; {text}")
    return facts


def capacity_table(plan: Plan) -> Table:
    """Return what the table can do, and where each number comes from."""
    capacity = plan.capacity
    numbers: list[tuple[str, str, str]] = [
        ("stroke", f"{capacity.stroke * 1e3:g} mm", "stroke"),
        ("velocity", f"{capacity.velocity:g} m/s", "velocity"),
        ("acceleration", f"{capacity.acceleration:g} m/s2", "acceleration"),
    ]
    for name, unit in (("jerk", "m/s3"), ("frequency", "Hz"), ("payload", "kg")):
        value: float | None = getattr(capacity, name)
        if value is not None:
            numbers.append((name, f"{value:g} {unit}", name))
    rows = [(label, value, capacity.provenance.get(key, "no source given")) for label, value, key in numbers]
    whole = plan.whole_run
    note = "" if whole is None or whole.released else f"motion: {whole.mechanics.source}"
    return Table(f"Table {capacity.name}", ("limit", "value", "source"), tuple(rows), note)


def stop_table(whole: WholeRun) -> Table | None:
    """Return when stopping compares with going on in which way, then the longest and the furthest stop."""
    study = whole.ramp_down
    if study is None:
        return None
    stretches = _stretches(study)
    rows = [_row(whole, study, stretch) for stretch in stretches[:MOST_STRETCHES]]
    if len(stretches) > MOST_STRETCHES:
        rows.append(("…", f"{len(stretches) - MOST_STRETCHES} more", "", "", "", ""))
    for label, (time, stop) in (("longest", study.longest), ("furthest out", study.furthest)):
        if stop.duration > 0.0:
            rows.append((f"{time:.3f}", f"{label} ({whole.phase_at(time)})", *_comparing(study, time), *_size(stop)))
    ends = "; ".join(impact_words(impact) for impact in whole.impacts)
    name = "Stopping at any moment" if whole.released else "Emergency ramp-down at any moment"
    columns = ("decided, s", "phase", "if it goes on", "if stopped", "takes, s", "over, mm")
    return Table(
        f"{name}, every {study.spacing * 1e3:.3g} ms", columns, tuple(rows), f"end stops: {ends}" if ends else ""
    )


def _stretches(study: StopStudy) -> list[Interval]:
    """Return the stretches to be named: all of them, or only those that are not plainly safe where there are many."""
    found = study.intervals
    if len(found) > MOST_STRETCHES:
        found = [interval for interval in found if interval.comparison != STANDS_EITHER_WAY]
    return found


def _row(whole: WholeRun, study: StopStudy, stretch: Interval) -> tuple[str, ...]:
    inside = [
        stop
        for time, stop in zip(study.times.tolist(), study.stops, strict=True)
        if stretch.start <= time <= stretch.end
    ]
    first, last = whole.phase_at(stretch.start), whole.phase_at(stretch.end)
    phases = first if first == last else f"{first} to {last}"
    if stretch.start <= study.times[0] and stretch.end >= study.times[-1]:
        phases = "the whole run"
    longest = max(inside, key=lambda stop: stop.duration)
    return (
        f"{stretch.start:.3f} to {stretch.end:.3f}",
        phases,
        *_comparing(study, stretch.start),
        f"up to {longest.duration:.2f}",
        f"up to {max(stop.distance for stop in inside) * 1e3:.0f}",
    )


def _comparing(study: StopStudy, time: float) -> tuple[str, str]:
    k = min(range(len(study.times)), key=lambda k: abs(float(study.times[k]) - time))
    on, stopped = WORDS[study.going_on], WORDS[int(study.outcomes[k])]
    return on, stopped.upper() if stopped == "falls" and on == "stands" else stopped


def _size(stop: Stop) -> tuple[str, str]:
    return f"{stop.duration:.2f}", f"{stop.distance * 1e3:.0f}"


def _reproduce(plan: Plan, origin: Origin) -> tuple[Fact, ...]:
    facts: list[Fact] = []
    if origin.made_words:
        facts.append(Fact("made", origin.made_words))
    if origin.command:
        facts.append(Fact("command", origin.command))
    facts += [Fact("sha-256", f"{name}: {digest}") for name, digest in origin.files.items()]
    facts.append(Fact("versions", ", ".join(f"{name} {value}" for name, value in origin.versions.items())))
    facts.append(Fact("seed", f"{plan.scene.spreads.seed} (futures), {plan.scene.table.seed} (emulated table)"))
    return tuple(facts)
