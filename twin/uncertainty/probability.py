"""A probability that was counted, and how surely it is known.

The interval is Clopper and Pearson's (Biometrika 26, 1934): exact for independent futures, never too short.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import cast

from scipy.special import betaincinv  # pyright: ignore[reportMissingTypeStubs, reportUnknownVariableType]

CONFIDENCE = 0.95


@dataclass(frozen=True, slots=True)
class Probability:
    """`overturned` of `count` futures fall; of `undecided` ones nobody knows, and they count to both ends.

    Examples
    --------
    >>> p = Probability(200, 22)
    >>> p.estimate, round(p.low, 4), round(p.high, 4)
    (0.11, 0.0702, 0.1618)
    >>> Probability(1000, 0).percent
    '0 % (0 to 0.37 %)'
    """

    count: int
    overturned: int
    undecided: int = 0

    @property
    def estimate(self) -> float:
        """Share of the futures that fall; of the undecided ones half."""
        return (self.overturned + 0.5 * self.undecided) / self.count

    @property
    def low(self) -> float:
        """Lower end of the interval of `CONFIDENCE`, were all undecided ones to stand."""
        k = self.overturned
        return 0.0 if k == 0 else _quantile(k, self.count - k + 1, 0.5 * (1.0 - CONFIDENCE))

    @property
    def high(self) -> float:
        """Upper end of the interval of `CONFIDENCE`, were all undecided ones to fall."""
        k = self.overturned + self.undecided
        return 1.0 if k == self.count else _quantile(k + 1, self.count - k, 0.5 * (1.0 + CONFIDENCE))

    @property
    def percent(self) -> str:
        """Estimate and interval in percent."""
        return f"{percent(self.estimate)} % ({percent(self.low)} to {percent(self.high)} %)"

    def data(self) -> dict[str, object]:
        """Return the same for `--json`."""
        return {
            "probability": self.estimate,
            "low": self.low,
            "high": self.high,
            "confidence": CONFIDENCE,
            "count": self.count,
            "overturned": self.overturned,
            "undecided": self.undecided,
        }


def _quantile(a: float, b: float, share: float) -> float:
    return float(cast("float", betaincinv(a, b, share)))


def percent(share: float) -> str:
    """Return a share in percent to what can be read of it: "9.8", "0.37", "99.7".

    Examples
    --------
    >>> percent(0.0981), percent(0.00366), percent(0.9999), percent(0.5)
    ('9.8', '0.37', '99.99', '50')
    """
    value = 100.0 * share
    near = min(value, 100.0 - value)
    if near <= 0.0:
        return f"{value:.0f}"
    places = 2 if near < 0.995 else 1
    return f"{value:.{places}f}".rstrip("0").rstrip(".") or "0"
