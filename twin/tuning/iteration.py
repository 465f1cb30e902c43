"""The iteration: play, compare, correct, inside the capacity, until the error stops falling."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from twin.rocking.compiled import FloatArray
from twin.tuning.reproduction import Measurement, Reproduction
from twin.tuning.transfer import Spectrum, TransferFunction
from twin.tuning.window import Trace, Window

GAIN = 0.8
"""Share of the correction that is applied: below 1, what noise and an inexact estimate put in decays again."""
LOW_GAIN = 0.2
"""Down to here the gain is halved where the error rises; below it a rise is a correction without a fall."""
LEAST_GAIN = 0.05
"""What the capacity leaves of the gain must be more than this, or it is not worth a run."""
BISECTIONS = 12
"""Of the largest gain inside the capacity: to 1 / 4096 of it."""
LEAST_FALL = 0.05
"""A fall of the error by a smaller share than this, or within two standard errors, is none."""
PATIENCE = 2
"""Corrections in a row without a fall after which the error is said to have stopped falling."""
REPEATABLE = 0.5
"""Spread of equal runs over the error, above which no correction can be told from chance."""

Play = Callable[[FloatArray], Trace]
"""Performs a command (where to be at each sample of the whole run, m) and returns what was measured."""
Refused = Callable[[FloatArray], str | None]
"""Says why a command is beyond the table's capacity, in one sentence; None where it is not."""


@dataclass(frozen=True, slots=True)
class Step:
    """One command that was played: how well it did, and how it was made from the one before.

    `gain` is the share of the correction that was applied, 0 for the command as asked; `limited` says what held the
    gain back; `highest` is the frequency up to which the command was corrected, Hz.
    """

    reproduction: Reproduction
    gain: float
    limited: str | None
    highest: float


@dataclass(slots=True)
class Tuning:
    """What the iteration came to.

    Attributes
    ----------
    steps : list of Step
        Every command that was played, the first as asked.
    correction : FloatArray, shape (size,)
        Of the best command, m, added to the asked position at the window's samples; 0 at both ends.
    reason : str
        Why it ended, one clause.
    verified : Reproduction or None
        Of the best command, played again: choosing the best of several noisy results flatters it.
    """

    correction: FloatArray
    reason: str = ""
    steps: list[Step] = field(default_factory=list[Step])
    verified: Reproduction | None = None

    @property
    def before(self) -> Reproduction:
        """Of the command as asked."""
        return self.steps[0].reproduction

    @property
    def spread(self) -> float:
        """Root mean square of the `Reproduction.spread` of all commands."""
        return math.sqrt(sum(step.reproduction.spread**2 for step in self.steps) / len(self.steps))

    @property
    def improved(self) -> bool:
        """Whether the best command is better than the one as asked, by more than chance."""
        return self.verified is not None and self.falls(self.before, self.verified)

    def falls(self, before: Reproduction, after: Reproduction) -> bool:
        """Return whether the error fell, by more than chance and by enough to be worth a run."""
        # One standard error of three runs is itself uncertain: those of all commands are put together.
        known = [step.reproduction.rms_error for step in self.steps]
        chance = 2.0 * math.sqrt(2.0 * sum(error * error for error in known) / len(known))
        return before.rms - after.rms > max(chance, LEAST_FALL * before.rms)


def tune(
    window: Window,
    command: FloatArray,
    play: Play,
    refused: Refused,
    *,
    repeats: int = 3,
    most: int = 10,
    gain: float = GAIN,
    told: Callable[[int, Step], object] | None = None,
) -> Tuning:
    """Correct `command` until the table performs what the window asks, or say why not.

        r_(k+1) = r_k + g F^-1[ B conj(H) / (|H|^2 + floor^2) E_k ]

    with E_k the spectrum of asked less measured position, H the measured transfer function and B its trusted band. The
    estimate takes in every run made so far. Where the error rises the gain is halved and the best command is taken up
    again, so that a table whose answer is not linear does not run away.

    Parameters
    ----------
    window : Window
    command : FloatArray
        Where to be at each sample of the whole run, as asked, m.
    play : callable
        Plays a command once. What it raises ends the iteration.
    refused : callable
        Asked about every corrected command before it is played.
    repeats : int
        Runs of each command, at least 2: their differences tell chance from error.
    most : int
        Largest number of corrections.
    gain : float
        Of the correction, above 0, at most 1.
    told : callable, optional
        Called with number and step after each command.

    Returns
    -------
    Tuning
    """
    iteration = _Iteration(window, command, play, refused, repeats, gain, told)
    tuning = iteration.run(most)
    if tuning.correction.any():
        tuning.verified = iteration.measure(tuning.correction)[0]
    return tuning


class _Iteration:
    def __init__(
        self,
        window: Window,
        command: FloatArray,
        play: Play,
        refused: Refused,
        repeats: int,
        gain: float,
        told: Callable[[int, Step], object] | None,
    ) -> None:
        self.window, self.play, self.refused, self.repeats, self.told = window, play, refused, repeats, told
        self._asked = command
        self._gain = gain
        self._transfer = TransferFunction(window.size, window.cycle_time)
        self._measurement = Measurement(window, self._transfer)

    def run(self, most: int) -> Tuning:
        """Iterate; the result is not verified yet."""
        best = latest = np.zeros(self.window.size)
        tuning = Tuning(best)
        lowest, shortfall = self.measure(best)
        best_shortfall = shortfall
        self._tell(tuning, Step(lowest, 0.0, None, 0.0))
        if self._by_chance(tuning):
            return tuning
        idle = 0
        for _ in range(most):
            latest, gain, limited = self._corrected(latest, shortfall)
            if gain < LEAST_GAIN:
                tuning.reason = f"no room inside the capacity for a further correction: {limited}"
                return tuning
            highest = self._transfer.highest
            result, shortfall = self.measure(latest)
            self._tell(tuning, Step(result, gain, limited, highest))
            # A few runs may agree by luck: it is asked again after every command.
            if self._by_chance(tuning):
                return tuning
            fell, rose = tuning.falls(lowest, result), tuning.falls(result, lowest)
            if result.rms < lowest.rms:
                lowest, best_shortfall = result, shortfall
                tuning.correction = best = latest
            if rose and self._gain > LOW_GAIN:
                self._gain *= 0.5
                latest, shortfall = best, best_shortfall
                continue
            idle = 0 if fell else idle + 1
            if idle >= PATIENCE:
                tuning.reason = (
                    "converged: the error no longer falls" if best.any() else "no correction lowers the error"
                )
                return tuning
        tuning.reason = f"the error was still falling after {most} corrections"
        return tuning

    def measure(self, correction: FloatArray) -> tuple[Reproduction, Spectrum]:
        """Play a corrected command as often as asked; return its errors and the spectrum of what is still missing."""
        command = self._whole(correction)
        traces = [self.play(command) for _ in range(self.repeats)]
        spectrum = self._measurement.command(command)
        for trace in traces:
            self._transfer.add(spectrum, self._measurement.answer(trace))
        return self._measurement.errors(traces), self._measurement.shortfall(traces)

    def _corrected(self, correction: FloatArray, shortfall: Spectrum) -> tuple[FloatArray, float, str | None]:
        """Return the next correction, the gain it was made with, and what of the capacity held that back."""
        full = self._transfer.samples(self._transfer.inverse * shortfall, self.window.size) * self.window.fade
        limited = self.refused(self._whole(correction + self._gain * full))
        if limited is None:
            return correction + self._gain * full, self._gain, None
        # The commands inside a capacity are a convex set but for rounding and braking, and `correction` is in it.
        least, most = 0.0, self._gain
        for _ in range(BISECTIONS):
            middle = 0.5 * (least + most)
            if self.refused(self._whole(correction + middle * full)) is None:
                least = middle
            else:
                most = middle
        return correction + least * full, least, limited

    def _by_chance(self, tuning: Tuning) -> bool:
        """Say so, and take the correction back, where equal runs differ so much that the error may be chance."""
        if tuning.spread <= REPEATABLE * tuning.before.rms:
            return False
        tuning.correction = np.zeros(self.window.size)
        tuning.reason = (
            f"nothing to correct: equal runs differ by {tuning.spread:.1%} rms among themselves, "
            f"and the error is {tuning.before.rms:.1%}"
        )
        return True

    def _whole(self, correction: FloatArray) -> FloatArray:
        command = self._asked.copy()
        self.window.cut(command)[:] += correction
        return command

    def _tell(self, tuning: Tuning, step: Step) -> None:
        tuning.steps.append(step)
        if self.told is not None:
            self.told(len(tuning.steps) - 1, step)
