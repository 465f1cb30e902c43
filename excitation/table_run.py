"""What every whole run of a table answers, whoever makes it: its parts in time, and which of them shake the block."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass

from excitation.extremes import extremes
from excitation.pieces import Array, PieceTable, Span, as_spans, assemble, steady
from excitation.pulse import Pulse


@dataclass(frozen=True, slots=True)
class Phase:
    """A named part of a run from `start` to `end`, s."""

    name: str
    start: float
    end: float


class Course:
    """The spans of a run under construction, and the phases they belong to."""

    def __init__(self) -> None:
        self.spans: list[Span] = []
        self.phases: list[Phase] = []
        self._time = 0.0

    @property
    def position(self) -> float:
        """Where the run has got to, m."""
        return PieceTable(assemble(self.spans)).end[2]

    def add(self, name: str, *spans: Span) -> None:
        """Append a phase; its times are those that `assemble` will give its spans."""
        start = self._time
        for span in spans:
            self._time += span[0]
        self.spans.extend(spans)
        self.phases.append(Phase(name, start, self._time))

    def pause(self, name: str, length: float) -> None:
        """Append a pause of `length` (s), in which what rounding left of the velocity is taken out."""
        velocity = PieceTable(assemble(self.spans)).end[1] if self.spans else 0.0
        self.add(name, steady(length, -velocity / length))


class TableRun(Pulse):
    """A run: at rest at both ends, with a pulse in it. `Motion` is a servo table's, `ReleasedRun` a released machine's.

    Displacement is the table's position, 0 where the run starts.
    """

    pulse: Pulse | None

    @property
    @abstractmethod
    def phases(self) -> tuple[Phase, ...]:
        """The parts of the run in order, from 0 to `duration`."""

    @property
    @abstractmethod
    def shaking_end(self) -> float:
        """Time at which what shakes the block is over, s: pulse, coast, brake or end stop."""

    @abstractmethod
    def scaled(self, factor: float) -> TableRun:
        """Return the run of the scaled pulse."""

    @property
    def family(self) -> str:
        """The pulse's family."""
        return "standstill" if self.pulse is None else self.pulse.family

    @property
    def kind(self) -> str:
        """What sentences call it."""
        return "standstill" if self.pulse is None else f"run of a {self.pulse.kind}"

    @property
    def fundamental(self) -> float | None:
        """The pulse's frequency, Hz."""
        return None if self.pulse is None else self.pulse.fundamental

    @property
    def pulse_start(self) -> float:
        """Time at which the pulse starts, s; 0 at a standstill."""
        return next((phase.start for phase in self.phases if phase.name == "pulse"), 0.0)

    def peak_in(self, phase: Phase) -> float:
        """Return the largest |a| in one of the `phases`, m/s2."""
        rows = assemble(as_spans(self._rows_between(phase.start, phase.end)))
        return max(map(abs, extremes(PieceTable(rows)).acceleration)) if len(rows) else 0.0

    @property
    def shaking(self) -> Pulse:
        """What shakes the block: the run from the pulse to `shaking_end`, from time 0; a standstill's is all."""
        return Shaking(self)

    def _rows_between(self, start: float, end: float) -> Array:
        rows = self.pieces
        return rows[(rows[:, 0] >= start) & (rows[:, 1] <= end)]


@dataclass(frozen=True)
class Shaking(Pulse):
    """The part of a run that shakes the block, from time 0; see `TableRun.shaking`."""

    run: TableRun

    @property
    def family(self) -> str:
        """The run's family."""
        return self.run.family

    @property
    def kind(self) -> str:
        """What sentences call it."""
        return f"shaking part of a {self.run.kind}"

    def scaled(self, factor: float) -> Shaking:
        """Return the shaking of the scaled run."""
        return Shaking(self.run.scaled(factor))

    def _rows(self) -> Array:
        run = self.run
        if run.pulse is None:
            return run.pieces
        return assemble(as_spans(run._rows_between(run.pulse_start, run.shaking_end)))  # pyright: ignore[reportPrivateUsage]
