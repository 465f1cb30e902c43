"""How the scene's table answers, for the plan's futures: as asked, measured, by its linear model, or by a file."""

from __future__ import annotations

import argparse

from devices.catalogue import CatalogueEntry
from twin.commands.inputs import emulator_numbers
from twin.commands.tuned_run import LinearTable, known_answers
from twin.errors import InputError
from twin.rehearsal import Rehearsal
from twin.text_file import read_text
from twin.uncertainty.table import AS_ASKED, LinearResponse, MeasuredResponse, TableResponse, read_transfer


def response_of(options: argparse.Namespace, entry: CatalogueEntry, rehearsal: Rehearsal) -> TableResponse:
    """Return what `[uncertainty.table] response` asks for.

    "known" takes what `twin tune` has measured of exactly this pulse, else the emulated table's linear model, else the
    motion as asked; a released machine makes its own motion, which is asked of nobody.

    Raises
    ------
    InputError
        Where what is asked for is not there.
    """
    scene = rehearsal.scene
    asked = scene.spreads.table
    if asked.response == "file":
        path = scene.folder / (asked.response_file or "")
        return read_transfer(read_text(path), path.name)
    if asked.response == "asked" or rehearsal.given is None or rehearsal.capacity.machine is not None:
        return AS_ASKED
    if asked.response in ("known", "measured"):
        measured = [answer for answer in known_answers(options.tuned, entry, rehearsal) if "measured" in answer.source]
        # The run plays the corrected command, the last of the two.
        if measured and not rehearsal.scene.block.initial_rotation_deg:
            return MeasuredResponse(measured[-1])
        if asked.response == "measured":
            raise InputError(
                f"scene {scene.name}: uncertainty.table.response: nothing was measured of this pulse on {entry.name}; "
                "`twin tune` it first"
            )
    numbers = emulator_numbers(scene)
    if isinstance(numbers, LinearTable):
        return LinearResponse(numbers.loop(scene.block.mass_kg or 0.0).response, "by the emulated table's linear model")
    if asked.response == "emulator":
        raise InputError(
            f"scene {scene.name}: uncertainty.table.response: the emulator of {entry.name} has no linear model"
        )
    return AS_ASKED
