"""The corrected command of `twin tune` in a later run: looked for, checked, and said."""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol, runtime_checkable

from devices.catalogue import CIA402, CatalogueEntry
from devices.setpoints import first_refusal
from devices.table import ShakeTable
from excitation import Capacity
from excitation.table_run import TableRun
from twin.achieved import Achieved, as_measured, predicted
from twin.commands.connection import EMULATOR
from twin.commands.drivers import driver_of
from twin.commands.inputs import emulator_numbers
from twin.errors import InputError
from twin.live import set_points
from twin.rehearsal import Rehearsal
from twin.scene import Scene
from twin.tuned import Purpose, TunedCommand, purpose_of
from twin.tuned_folder import Found, find
from twin.tuning.play import Measured
from twin.tuning.reproduction import Measurement, Reproduction
from twin.tuning.transfer import TransferFunction
from twin.tuning.window import window_of

_HEAD = "tuned      "
_WHOSE = "the emulated table, untuned"


class LinearLoop(Protocol):
    """A table as long as nothing saturates: position over set-point at a frequency, Hz."""

    def response(self, frequency: float) -> complex: ...


@runtime_checkable
class LinearTable(Protocol):
    """Numbers of an emulated table that know its linear model with a payload, kg, on it."""

    def loop(self, payload: float = 0.0) -> LinearLoop: ...


@dataclass(frozen=True, slots=True)
class TunedRun:
    """What a run sends instead of the command as asked, and what is said of it.

    `targets` are the set-points of all cycles, m; None where the command is sent as asked. `start` is where the run
    begins, m.
    """

    targets: list[float] | None
    lines: list[str]
    start: float = 0.0
    command: TunedCommand | None = None
    file: str = ""

    @property
    def data(self) -> dict[str, str]:
        """For the recording and `--json`: the file and what remains, or why there is none."""
        if self.command is None:
            return {"used": "no", "reason": " ".join(self.lines).removeprefix(_HEAD)}
        after = self.command.after
        return {
            "used": "yes",
            "file": self.file,
            "made": self.command.made,
            "corrections": str(self.command.corrections),
            "remaining_rms": str(after.rms),
            "remaining_peak": str(after.peak),
            "noise_rms": str(after.noise),
            "reason": self.command.reason,
        }

    def check(self, table: ShakeTable) -> None:
        """Raise `InputError` where it is another table, or it would refuse a set-point: before anything moves."""
        if self.targets is None or self.command is None:
            return
        if (here := identity_of(table)) != self.command.identity:
            raise InputError(
                f"tuned command {self.file} was made on the machine {self.command.identity}; this one is {here}: "
                "`twin tune` it again, or give --untuned"
            )
        refusal = first_refusal(table.capacity, table.cycle_time, table.resolution, self.start, self.targets)
        if refusal is not None:
            raise InputError(f"tuned command {self.file}: {refusal.sentence}; give --untuned")


def identity_of(table: ShakeTable) -> str:
    """Return who an open table is: vendor, product, revision and serial number of its first node (object 1018)."""
    node = table.describe()[0]
    return f"{node.vendor:X}-{node.product:X}-{node.revision:X}-{node.serial:X}"


def tuned_run(options: argparse.Namespace, entry: CatalogueEntry, rehearsal: Rehearsal) -> TunedRun:
    """Look for the command corrected for exactly this run; raises `InputError` where there is one that is no use."""
    if rehearsal.given is None or rehearsal.capacity.machine is not None:
        return TunedRun(None, [])
    if driver_of(options) != CIA402:
        return TunedRun(None, [f"{_HEAD}no: commands are corrected over {CIA402}, and this is another position loop"])
    found = _found(options.tuned, entry, rehearsal, emulated=options.device == EMULATOR)
    if options.untuned:
        return TunedRun(None, [f"{_HEAD}no: --untuned" + ("" if found.command is None else f"; {found.path} is there")])
    if found.command is None:
        return TunedRun(None, [_HEAD + absent(found)])
    positions = set_points(rehearsal.motion, rehearsal.after, found.command.purpose.cycle_time)
    targets = found.command.corrected(positions, rehearsal.motion).tolist()
    line = _HEAD + present(found.command, found)
    return TunedRun(targets, [line], rehearsal.motion.displacement(0.0), found.command, str(found.path))


def purpose_for(
    scene: Scene, entry: CatalogueEntry, capacity: Capacity, motion: TableRun, *, emulated: bool
) -> Purpose:
    """Return what a command for a run of this scene has to be corrected for."""
    numbers = emulator_numbers(scene) if emulated else None
    made_of = "" if numbers is None else numbers.model_dump_json()
    cycle_time = 1.0 / scene.twin.cycle_hz
    emulator = made_of if emulated else None
    return purpose_of(entry.name, capacity, motion, cycle_time, scene.block.mass_kg, emulator=emulator)


def _found(folder: Path, entry: CatalogueEntry, rehearsal: Rehearsal, *, emulated: bool) -> Found:
    scene, capacity, motion = rehearsal.scene, rehearsal.capacity, rehearsal.motion
    return find(folder, purpose_for(scene, entry, capacity, motion, emulated=emulated))


def present(command: TunedCommand, found: Found) -> str:
    """Return how the command was made and what error it leaves, of the asked peak."""
    other = "" if command.payload == command.purpose.payload else f"; tuned with {command.payload:g} kg on the table"
    return (
        f"{command.corrections} corrections on {command.made[:10]}: error {command.after} of the asked peak, "
        f"{command.before.rms:.1%} rms before{other}; {found.path}"
    )


def absent(found: Found) -> str:
    """Return that there is no command, and what those that are there are for."""
    others = "; ".join(found.passed_over)
    return "no: the table is sent the command as asked" + (f" ({others}: not used)" if others else "")


def reproduced(rehearsal: Rehearsal, measured: Measured) -> Reproduction | None:
    """Return how well a run that was performed to its end made the asked acceleration; None where nothing shook."""
    if rehearsal.given is None or rehearsal.capacity.machine is not None:
        return None
    scene = rehearsal.scene
    cycle_time = 1.0 / scene.twin.cycle_hz
    window = window_of(rehearsal.motion, cycle_time, scene.table.settle_s)
    cycles = set_points(rehearsal.motion, rehearsal.after, cycle_time).size
    return Measurement(window, TransferFunction(window.size, cycle_time)).errors([measured.trace(cycles)])


def known_answers(folder: Path, entry: CatalogueEntry, rehearsal: Rehearsal) -> list[Achieved]:
    """Return what is known of the table's answer to a run: measured while tuning, else by its linear model if known."""
    if rehearsal.given is None or rehearsal.capacity.machine is not None:
        return []
    answers: list[Achieved] = []
    for emulated in (False, True):
        found = _found(folder, entry, rehearsal, emulated=emulated)
        if found.command is not None:
            answers += as_measured(found.command, rehearsal)
    numbers = emulator_numbers(rehearsal.scene)
    if not answers and isinstance(numbers, LinearTable):
        model = numbers.loop(rehearsal.scene.block.mass_kg or 0.0)
        answers.append(predicted(model.response, f"as asked (predicted by the linear model of {_WHOSE})", rehearsal))
    return answers
