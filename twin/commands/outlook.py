"""What a run's foresight is made of: the scene, the planned motion, and how the table follows its command."""

from __future__ import annotations

import math

from twin.commands.following import following_of
from twin.commands.recording import live_twin
from twin.forecast.loop import TableLoop
from twin.foresight import foresight
from twin.live_twin import LiveTwin
from twin.rehearsal import Rehearsal
from twin.scene import Scene


def table_loop(scene: Scene, *, tuned: bool = False) -> TableLoop:
    """Return how the scene's table follows its command.

    A corrected command is followed as asked. Otherwise as the device's linear model has it, whether the table is
    emulated or real; exactly where there is none (a released machine's motion is its plan).
    """
    numbers = None if tuned else following_of(scene)
    if numbers is None:
        return TableLoop()
    loop = numbers.loop(scene.block.mass_kg or 0.0)
    return TableLoop(loop.transport_delay, 1.0, loop.angular_frequency / math.tau, loop.damping)


def stoppable_until(rehearsal: Rehearsal) -> float | None:
    """Return the time of the run from which on nothing stops the table, s; None where it can always be stopped."""
    machine = rehearsal.capacity.machine
    return None if machine is None or machine.can_stop else rehearsal.motion.pulse_start


def twin_of_run(rehearsal: Rehearsal, *, tuned: bool = False) -> LiveTwin:
    """Return the twin of a rehearsed run before its first sample, with foresight unless the scene does without."""
    scene, capacity = rehearsal.scene, rehearsal.capacity
    if not scene.twin.forecast:
        return live_twin(scene)
    loop, until = table_loop(scene, tuned=tuned), stoppable_until(rehearsal)
    pieces = rehearsal.motion.pieces
    return live_twin(scene, foresight(scene, pieces, capacity.stroke, capacity.acceleration, loop, until))
