"""The table's transfer function, estimated from the runs themselves, with the error of the estimate.

    H1(f) = S_yu(f) / S_uu(f),    gamma^2(f) = |S_yu|^2 / (S_uu S_yy)

averaged over runs and over neighbouring frequencies; random error of |H1|: sqrt((1 - gamma^2) / (2 n gamma^2)) with n
independent averages (J. S. Bendat, A. G. Piersol, Random Data, 4th ed. 2010, ch. 6 and 9).
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from twin.rocking.compiled import FloatArray

Spectrum = NDArray[np.complex128]

RESOLUTION = 2.0
"""Full width at half maximum over which spectra are averaged, Hz."""
TRUSTED = 0.3
"""Random error of |H| up to which a frequency is corrected: 0.3 in size is 0.3 rad, 17 degrees, in phase."""
HIGHEST = 0.2
"""Highest frequency that is corrected, as a share of the cycle rate."""
FLOOR = 0.2
"""Of |H|, below which the inverse is held back: what the table hardly follows is not commanded harder and harder."""
_ROUNDING = 1e-12


class TransferFunction:
    """From commanded to measured acceleration, as functions of frequency; grows with every run that is added.

    Parameters
    ----------
    size : int
        Samples of a run's window.
    cycle_time : float
        s.
    """

    def __init__(self, size: int, cycle_time: float) -> None:
        # Twice the window and more: what wraps round the end of the transform meets zeros.
        self.length = 1 << math.ceil(math.log2(2 * size))
        self.cycle_time = cycle_time
        self.frequencies: FloatArray = np.asarray(np.fft.rfftfreq(self.length, cycle_time), np.float64)
        # Averaging over frequencies is a window over lags: sigma_f = width / sqrt(8 ln 2), sigma_t = 1/(2 pi sigma_f).
        spread = RESOLUTION / math.sqrt(8.0 * math.log(2.0))
        lags = np.fft.fftfreq(self.length, 1.0 / self.length) * cycle_time
        self._lag_window = np.exp(-0.5 * (math.tau * spread * lags) ** 2)
        self._averages = 2.0 * math.sqrt(math.pi) * spread * size * cycle_time
        self._runs = 0
        self._delay: float | None = None
        self._uu = self._yy = np.zeros_like(self.frequencies)
        self._yu: Spectrum = np.zeros_like(self.frequencies, dtype=np.complex128)

    def spectrum(self, samples: FloatArray) -> Spectrum:
        """Return the transform of a window's samples, zeros behind them."""
        return np.fft.rfft(samples, self.length)

    def samples(self, spectrum: Spectrum, size: int) -> FloatArray:
        """Return the first `size` samples of a transform."""
        return np.fft.irfft(spectrum, self.length)[:size]

    def add(self, command: Spectrum, measured: Spectrum) -> None:
        """Take one run."""
        if self._delay is None:
            # Averaging over frequencies would take a delay for incoherence: it is put aside first.
            correlation = np.fft.irfft(measured * np.conj(command), self.length)
            self._delay = float(np.argmax(correlation[: self.length // 2])) * self.cycle_time
        self._runs += 1
        self._uu = self._uu + self._smoothed(np.abs(command) ** 2).real
        self._yy = self._yy + self._smoothed(np.abs(measured) ** 2).real
        self._yu = self._yu + self._smoothed(measured * np.conj(command * self._delayed))

    @property
    def estimate(self) -> Spectrum:
        """H1; 0 where nothing was commanded."""
        h = np.zeros_like(self._yu)
        np.divide(self._yu, self._uu, out=h, where=self._excited)
        return h * self._delayed

    @property
    def coherence(self) -> FloatArray:
        """gamma^2, 0 to 1; 0 where nothing was commanded."""
        coherence = np.zeros_like(self._uu)
        np.divide(np.abs(self._yu) ** 2, self._uu * self._yy, out=coherence, where=self._excited & (self._yy > 0.0))
        return np.minimum(coherence, 1.0)

    @property
    def error(self) -> FloatArray:
        """Random error of |H1| relative to it; infinite where nothing is known."""
        coherent = self.coherence
        averages = max(self._averages * self._runs, 1.0)
        with np.errstate(divide="ignore"):
            return np.sqrt((1.0 - coherent) / (2.0 * averages * coherent))

    @property
    def band(self) -> FloatArray:
        """How far a frequency is corrected, 0 to 1: 1 where the estimate is trusted, without sharp edges."""
        inside = (self.error < TRUSTED) & (self.frequencies <= HIGHEST / self.cycle_time)
        return np.clip(self._smoothed(inside.astype(np.complex128)).real, 0.0, 1.0)

    @property
    def highest(self) -> float:
        """Frequency up to which most of the band is trusted, Hz; 0 where nothing is."""
        share = np.cumsum(self.band) / np.arange(1, self.band.size + 1)
        trusted = np.flatnonzero((share > 0.5) & (self.band > 0.5))
        return float(self.frequencies[trusted[-1]]) if trusted.size else 0.0

    @property
    def inverse(self) -> Spectrum:
        """conj(H) / (|H|^2 + floor^2) inside the band, 0 outside."""
        h = self.estimate
        inverse: Spectrum = np.conj(h)
        inverse *= self.band / (np.abs(h) ** 2 + FLOOR**2)
        return inverse

    @property
    def _excited(self) -> NDArray[np.bool_]:
        # Below this share of the largest power density the transform's own rounding is all there is.
        return self._uu > _ROUNDING * np.max(self._uu)

    @property
    def _delayed(self) -> Spectrum:
        return np.exp(-2j * math.pi * self.frequencies * (self._delay or 0.0))

    def _smoothed(self, spectrum: FloatArray | Spectrum) -> Spectrum:
        return np.fft.rfft(np.fft.irfft(spectrum, self.length) * self._lag_window)
