"""The faults a run or an emulator was asked for: which act in this process, and what the live loop has of them."""

from __future__ import annotations

import argparse
import time
from collections.abc import Sequence

import numpy as np

from devices.clock import Clock, WallClock
from devices.faults.fault import Fault, Side
from devices.faults.injector import Injector
from twin.cycle import Event, Sink
from twin.errors import InputError
from twin.live import set_points
from twin.live_loop import Ends
from twin.rehearsal import Rehearsal
from twin.scene import Scene
from twin.scene_faults import fault_parts

_SEED = 7


def with_asked_faults(scene: Scene, options: argparse.Namespace, side: Side | None) -> Scene:
    """Return the scene with the faults of `--fault` in it; `side` is the only one this process has, None for both.

    Raises
    ------
    InputError
        No such fault, or one that acts in the other process.
    """
    asked = fault_parts(options.fault)
    for part in asked:
        kind = part.fault().kind
        if side is not None and kind.side != side:
            command = "twin emulate" if kind.side == "emulator" else "twin run"
            raise InputError(f"--fault {kind.name} acts in the {kind.side}: give it to `{command}`")
    return scene.with_faults(asked) if asked else scene


def refuse_faults(scene: Scene, device: str) -> None:
    """Refuse a scene with faults for a real device; raises `InputError`."""
    if scene.fault:
        raise InputError(f"fault {scene.fault[0].name}: a fault may be injected into emulators only; {device} is real")


def injector_for(scene: Scene, clock: Clock | None, *sides: Side) -> Injector | None:
    """Return what injects the scene's faults of these sides, those of this process; None where there are none."""
    faults: list[Fault] = [part.fault() for part in scene.fault]
    here = [fault for fault in faults if fault.kind.side in sides]
    if not here:
        return None
    rng = np.random.default_rng([scene.table.seed, _SEED])
    return Injector(here, clock or WallClock(), 1.0 / scene.twin.cycle_hz, rng)


class Injection:
    """What the live loop of a run has of its faults; nothing where there are none.

    Parameters
    ----------
    injector : Injector or None
    clock : Clock or None
        Of the run; the wall clock unless told.
    """

    def __init__(self, injector: Injector | None, clock: Clock | None) -> None:
        self._injector = injector
        self.clock: Clock = (clock or WallClock()) if injector is None else injector.clock

    def announce(self, sink: Sink) -> None:
        """Let the recording say what is injected, in the cycle in which it begins."""
        if self._injector is None:
            return

        def say(fault: Fault, moment: float) -> None:
            sink.event(Event(moment, time.time_ns(), "warning", "fault", f"injected: {fault.name}: {fault.sentence}"))

        self._injector.schedule.announce = say

    def targets(self, rehearsal: Rehearsal, planned: Sequence[float] | None) -> Sequence[float] | None:
        """Return the set-points to send, m, tampered with below the planner; None for the motion's own."""
        if self._injector is None:
            return planned
        cycle_time = self._injector.schedule.cycle_time
        own: list[float] = set_points(rehearsal.motion, rehearsal.after, cycle_time).tolist()
        return self._injector.set_points(own if planned is None else planned)

    def stopped(self) -> Ends | None:
        """Return the injected operator's reason to stop, if he has one by now."""
        reason = None if self._injector is None else self._injector.stopped()
        return None if reason is None else Ends("operator", reason.removeprefix("operator: "))
