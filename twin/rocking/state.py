"""Where each number stands in the arrays that compiled code passes around: block, state, recorded step, event."""

from __future__ import annotations

from twin.rocking.compiled import FloatArray, compiled
from twin.rocking.series import ORDER

# What a run needs to know of its block: see `parameters`.
ALPHA, P, GRAVITY, RESTITUTION, THRESHOLD, TOLERANCE, STRIDE = range(7)
# The state: time s, side, phi rad, psi = alpha - phi rad, v = d(phi)/d(p t), peak rad, the error ellipse, doubt.
TIME, SIDE, PHI, PSI, RATE, PEAK, E11, E12, E22, WORST, DOUBT, AT_REST = range(12)
STATE_SIZE = 12
# A recorded step: start s, length (1/p), side, coefficients.
STEP_COLUMNS = 3 + ORDER + 1
# An event: time s, signed rate rad/s (before an impact), code.
EVENT_COLUMNS = 3
IMPACT, UPLIFT, REST, OVERTURNED = 1.0, 2.0, 3.0, 4.0


@compiled
def record(steps: FloatArray, used: FloatArray, t: float, h: float, side: float, c: FloatArray) -> None:
    """Append a step: start s, length 1/p, side, coefficients (zeros at rest)."""
    row = steps[int(used[0])]
    row[0] = t
    row[1] = h
    row[2] = side
    if side == 0.0:
        row[3:] = 0.0
    else:
        row[3:] = c
    used[0] += 1.0


@compiled
def note(events: FloatArray, used: FloatArray, t: float, rate: float, code: float) -> None:
    """Append an event, where events are kept: time s, signed rate rad/s, code."""
    if events.shape[0] == 0:
        return
    row = events[int(used[1])]
    row[0] = t
    row[1] = rate
    row[2] = code
    used[1] += 1.0
