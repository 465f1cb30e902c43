"""Bring a table from where it stands to where a run begins: after a stop it stands anywhere inside the stroke."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from devices.errors import DeviceNotReady, DeviceTimeout
from excitation import SineWave
from excitation.motion import SHORTEST_MOVE

if TYPE_CHECKING:
    from collections.abc import Callable

    from devices.clock import Clock
    from devices.table import ShakeTable
    from excitation import Capacity

SETTLE = 0.25
"""Time the table is held at its destination, s: many times the lag of its position loop."""
_MOVES = 3
# A move at the limit itself would be refused where rounding is against it.
_MARGIN = 1.0 + 1e-6


def distance_to(table: ShakeTable, destination: float) -> float:
    """Return how far an open table stands from `destination`, m, signed; 0 where it can be enabled there as it is."""
    distance = destination - table.position
    return 0.0 if abs(distance) <= table.start_window else distance


def bring_to(
    table: ShakeTable,
    destination: float,
    acceleration: float,
    clock: Clock,
    *,
    stopped: Callable[[], bool] = lambda: False,
) -> bool:
    """Drive an open table, powered off, to `destination`, m; return whether it stands there, powered off again.

    One sine of acceleration, as a motion's own approach. Nothing is done where the table stands there already. Whatever
    stands on the table is moved with it: keep `acceleration`, m/s2, under half of g tan(alpha). Late cycles are left
    out, as in a run.

    Parameters
    ----------
    table : ShakeTable
    destination : float
        m, inside the stroke.
    acceleration : float
        Largest acceleration on the way, m/s2, above 0; the capacity's where that is less.
    clock : Clock
    stopped : callable
        Asked every cycle whether the operator wants to stop; the table is then stopped and False returned.

    Raises
    ------
    DeviceNotReady
        Where the table cannot be driven there: a released machine is put back by hand.
    DeviceTimeout
        Where it does not come to stand there in three moves.
    DeviceError
        As `ShakeTable.enable` and `exchange`; close the table then, which stops it.
    """
    for _ in range(_MOVES):
        if (distance := distance_to(table, destination)) == 0.0:
            return True
        if not table.follows_setpoints:
            raise DeviceNotReady(
                f"{table.name} stands {abs(distance) * 1e3:.1f} mm from where it is held: put it back by hand"
            )
        if not _move(table, destination, acceleration, clock, stopped):
            return False
    if (distance := distance_to(table, destination)) != 0.0:
        raise DeviceTimeout(
            f"{table.name} still stands {abs(distance) * 1e3:.3f} mm from where it was moved to {_MOVES} times"
        )
    return True


def _move(
    table: ShakeTable, destination: float, acceleration: float, clock: Clock, stopped: Callable[[], bool]
) -> bool:
    """Make one move; return whether it was made to its end. A computer that stalls may leave it short."""
    half, h = 0.5 * table.capacity.stroke, table.cycle_time
    # A table stopped at the very end of its stroke may be measured beyond it, by less than an encoder step.
    start = min(max(table.position, -half), half)
    distance = destination - start
    duration = _shortest(abs(distance), acceleration, table.capacity)
    move = SineWave(2.0 * math.pi * distance / duration**2, 1.0 / duration)
    table.enable(start)
    begin = clock.now()
    cycle, last = 0, math.ceil((duration + SETTLE) / h)
    while cycle <= last:
        late = int(clock.wait_until(begin + cycle * h) / h)
        cycle = min(cycle + late, last)
        end = (cycle + 1) * h
        table.exchange(cycle, start + (move.displacement(end) if end < duration else distance))
        if stopped():
            table.quick_stop()
            return False
        cycle += 1
    table.disable()
    return True


def _shortest(size: float, acceleration: float, capacity: Capacity) -> float:
    """Return the time, s, of a sine over `size`, m. Peaks: a = 2 pi X / T^2, v = 2 X / T, da/dt = 4 pi^2 X / T^3."""
    if not (math.isfinite(acceleration) and acceleration > 0.0):
        raise ValueError(f"positioning acceleration is {acceleration} m/s2; it must be finite and above 0")
    limit = min(acceleration, capacity.acceleration)
    return _MARGIN * max(
        math.sqrt(2.0 * math.pi * size / limit),
        2.0 * size / capacity.velocity,
        0.0 if capacity.jerk is None else (4.0 * math.pi**2 * size / capacity.jerk) ** (1.0 / 3.0),
        0.0 if capacity.frequency is None else 1.0 / capacity.frequency,
        SHORTEST_MOVE,
    )
