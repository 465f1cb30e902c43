"""How the host's clock ran beside the table's: a straight line through every sample, fitted as they come."""

from __future__ import annotations

import math


class ClockFit:
    """Least-squares line of the host's wall clock over the table's clock, in constant memory.

    The line is offset + (1 + drift) t; what is summed is the difference of the two clocks, by the running means and
    products of Welford (1962), which lose no digits in long runs.

    >>> fit = ClockFit()
    >>> for k in range(1000):
    ...     fit.add(k * 1e-3, 1_760_000_000_000_000_000 + 5_000 + round(k * 1e6 * (1 + 20e-6)))
    >>> {name: float(value) for name, value in fit.to_metadata().items()}["drift_ppm"]
    20.0
    """

    def __init__(self) -> None:
        self._origin_ns: int | None = None
        self._count = 0
        self._time = self._lag = 0.0
        self._time_time = self._time_lag = self._lag_lag = 0.0

    def add(self, time: float, host_ns: int) -> None:
        """Take a sample: `time` on the table's clock, s, and the host's wall clock as it arrived, ns since 1970."""
        if self._origin_ns is None:
            self._origin_ns = host_ns - round(time * 1e9)
        lag = (host_ns - self._origin_ns) * 1e-9 - time
        self._count = count = self._count + 1
        from_time, from_lag = time - self._time, lag - self._lag
        self._time += from_time / count
        self._lag += from_lag / count
        self._time_time += from_time * (time - self._time)
        self._time_lag += from_time * (lag - self._lag)
        self._lag_lag += from_lag * (lag - self._lag)

    def to_metadata(self) -> dict[str, str]:
        """Key and value pairs for the metadata record `clock`; empty for fewer than two instants.

        `fit_offset_ns` is the host's clock where the table's reads 0, `drift_ppm` how much faster the host's clock
        runs, `residual_us` the root mean square left, of `samples` samples.
        """
        if self._origin_ns is None or self._count < 2 or not self._time_time > 0.0:
            return {}
        drift = self._time_lag / self._time_time
        offset = self._lag - drift * self._time
        left = max(self._lag_lag - drift * self._time_lag, 0.0) / self._count
        if not (math.isfinite(offset) and math.isfinite(drift)):
            return {}
        return {
            "fit_offset_ns": str(self._origin_ns + round(offset * 1e9)),
            "drift_ppm": f"{drift * 1e6:.3f}",
            "residual_us": f"{math.sqrt(left) * 1e6:.3f}",
            "samples": str(self._count),
        }
