"""What an operator is told: whether going on or ramping down is better, as far as the futures can tell them apart."""

from __future__ import annotations

from typing import Literal

Advice = Literal["none", "continue", "stopping helps", "stopping would topple it", "too late", "undecided"]
"""`none`: there is nothing to advise yet."""

SAFE = 0.125
"""Share of futures that may overturn where going on, or stopping, counts as safe."""
FALLS = 0.5
"""Share from which it counts as falling."""
HOPELESS = 0.875
"""Share from which, whatever is done, it is too late."""
SEPARATE = 0.25
"""Least difference of the two shares for one to be said to be better."""


def advise(going_on: float, stopping: float) -> Advice:
    """Return the advice for the shares of futures that overturn if the run goes on and if it is ramped down now.

    Examples
    --------
    >>> advise(0.0, 0.03125), advise(0.9, 0.0), advise(0.0, 0.75), advise(1.0, 1.0), advise(0.5, 0.4)
    ('continue', 'stopping helps', 'stopping would topple it', 'too late', 'undecided')
    """
    if going_on >= HOPELESS and stopping >= HOPELESS:
        return "too late"
    if going_on >= FALLS and going_on - stopping >= SEPARATE:
        return "stopping helps"
    if stopping >= FALLS and stopping - going_on >= SEPARATE:
        return "stopping would topple it"
    return "continue" if going_on <= SAFE else "undecided"
