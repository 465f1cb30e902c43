"""How well a set of equal runs reproduced the asked acceleration, and how well they reproduced each other."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from twin.rocking.compiled import FloatArray
from twin.tuning.transfer import Spectrum, TransferFunction
from twin.tuning.window import Trace, Window

CROSSOVER = 1.0
"""Hz. Above it the accelerometer is believed, below it the encoder.

The block feels acceleration, and the accelerometer sits on the table; the encoder sits on the motor and sees neither
the play nor the give of what lies between. But a correction is a position, acceleration over omega squared: at low
frequencies the accelerometer's noise and drift would become millimetres, where the encoder is good to micrometres.
"""
QUIET = 100.0
"""Hz. The measured acceleration is judged up to here: above it an accelerometer reports its own noise."""
_STEEPNESS = 8
LONGEST_LAG = 0.05
"""s, to either side, within which a lag is looked for."""
LAGS, REFINEMENTS = 21, 3
"""Lags that are tried, and how often finer ones are tried about the best: 5 ms, 0.5 ms and 0.05 ms apart."""


@dataclass(frozen=True, slots=True)
class Reproduction:
    """Errors of the mean of `runs` equal runs, as shares of the asked peak.

    Attributes
    ----------
    rms, peak : float
        Root mean square and largest |asked - achieved| over the pulse and what is judged beside it.
    lag : float
        Time by which the achieved acceleration comes late, s: what makes `shape` least. The block does not mind it.
    shape : float
        Root mean square error without that lag.
    rms_error : float
        Standard error of `rms`, by leaving out one run at a time; NaN of a single run, as `spread`.
    spread : float
        Root mean square by which one run differs from another, over the square root of two: noise and what the table
        does not repeat.
    sensors : float
        Root mean square difference between accelerometer and twice differentiated encoder up to `AGREEING`, Hz.
    runs : int
    acceleration : FloatArray, shape (size,)
        Achieved, m/s2: the mean of the runs, up to `QUIET`.
    """

    rms: float
    peak: float
    lag: float
    shape: float
    rms_error: float
    spread: float
    sensors: float
    runs: int
    acceleration: FloatArray

    @property
    def noise(self) -> float:
        """What of `rms` is noise, as a share of the asked peak."""
        return self.spread / self.runs**0.5


AGREEING = 20.0
"""Hz, see `Reproduction.sensors`: above it the encoder's steps, differentiated twice, say little."""


class Measurement:
    """Turns traces into spectra and errors.

    Parameters
    ----------
    window : Window
    transfer : TransferFunction
        Of the same size.
    """

    def __init__(self, window: Window, transfer: TransferFunction) -> None:
        self._window = window
        self._transfer = transfer
        f: FloatArray = transfer.frequencies
        self._step = window.cycle_time
        with np.errstate(divide="ignore"):
            self._fast = 1.0 / (1.0 + (CROSSOVER / f) ** 4)
        # The second difference's own factor, so that summing it up twice returns the positions exactly.
        self._twice = (2.0 * np.cos(2.0 * np.pi * f * self._step) - 2.0) / self._step**2
        self._quiet = _low_pass(f, QUIET)
        self._agreeing = _low_pass(f, AGREEING)

    def command(self, command: FloatArray) -> Spectrum:
        """Return the spectrum of a whole run's commanded acceleration; `command` is where to be at each sample, m."""
        return self._transfer.spectrum(self._window.curvature(command))

    def answer(self, trace: Trace) -> Spectrum:
        """Return the spectrum of the measured acceleration: accelerometer above `CROSSOVER`, encoder below."""
        slow = self._transfer.spectrum(self._window.curvature(trace.position))
        fast = self._transfer.spectrum(self._window.unbiased(trace.acceleration))
        return (1.0 - self._fast) * slow + self._fast * fast

    def shortfall(self, traces: list[Trace]) -> Spectrum:
        """Return the spectrum of asked less measured position, mean of the runs, put together in the same way."""
        window, transfer = self._window, self._transfer
        position = np.mean([window.cut(trace.position) for trace in traces], axis=0)
        acceleration = np.mean([window.unbiased(trace.acceleration) for trace in traces], axis=0)
        slow = transfer.spectrum((window.position[1:-1] - position) * window.fade)
        fast = transfer.spectrum((window.asked_curvature - acceleration) * window.fade)
        integrated = np.zeros_like(fast)
        integrated[1:] = self._fast[1:] * fast[1:] / self._twice[1:]
        return (1.0 - self._fast) * slow + integrated

    def errors(self, traces: list[Trace]) -> Reproduction:
        """Return how well the runs reproduced the asked acceleration."""
        window, judged, peak = self._window, self._window.judged, self._window.peak
        achieved = np.array([self._heard(window.unbiased(trace.acceleration), self._quiet) for trace in traces])
        error = window.acceleration - achieved
        count = len(traces)
        whole = np.mean(error, axis=0)
        chance = spread = math.nan
        if count > 1:
            left_out = np.array([_rms((count * whole - one)[judged] / (count - 1)) for one in error])
            chance = math.sqrt((count - 1) / count * float(np.sum((left_out - np.mean(left_out)) ** 2))) / peak
            spread = _rms(np.std(error[:, judged], axis=0, ddof=1)) / peak
        differs = [
            self._heard(window.unbiased(trace.acceleration) - window.curvature(trace.position), self._agreeing)
            for trace in traces
        ]
        mean = np.mean(achieved, axis=0)
        lag = self._lag(mean)
        return Reproduction(
            rms=_rms(whole[judged]) / peak,
            peak=float(np.max(np.abs(whole[judged]))) / peak,
            lag=lag,
            shape=self._without(lag, mean) / peak,
            rms_error=chance,
            spread=spread,
            sensors=_rms(np.mean(differs, axis=0)[judged]) / peak,
            runs=count,
            acceleration=mean,
        )

    def _lag(self, achieved: FloatArray) -> float:
        """Return the lag that leaves the least error, s."""
        found, width = 0.0, LONGEST_LAG
        for _ in range(REFINEMENTS):
            lags: list[float] = np.linspace(found - width, found + width, LAGS).tolist()
            found = min(lags, key=lambda lag: self._without(lag, achieved))
            width *= 2.0 / (LAGS - 1)
        return found

    def _without(self, lag: float, achieved: FloatArray) -> float:
        """Return the root mean square error once `lag` is taken out of what was achieved, m/s2."""
        ahead = np.exp(2j * np.pi * self._transfer.frequencies * lag) * self._transfer.spectrum(achieved)
        return _rms((self._window.acceleration - self._transfer.samples(ahead, self._window.size))[self._window.judged])

    def _heard(self, samples: FloatArray, low_pass: FloatArray) -> FloatArray:
        return self._transfer.samples(low_pass * self._transfer.spectrum(samples), self._window.size)


def _low_pass(frequencies: FloatArray, corner: float) -> FloatArray:
    """Return the size of a Butterworth low-pass, without its phase."""
    return 1.0 / np.sqrt(1.0 + (frequencies / corner) ** (2 * _STEEPNESS))


def _rms(values: FloatArray) -> float:
    return float(np.sqrt(np.mean(values**2)))
