"""`[notes]` of a scene file: what no instrument measures, for whoever opens the recording years later."""

from __future__ import annotations

from typing import Annotated

from pydantic import BaseModel, Field

from twin.scene_parts import Part

Note = Annotated[str, Field(max_length=10_000)]


class NotesPart(Part):
    """`[notes]`: who, what stands on the table, and anything else."""

    operator: Note = ""
    specimen: Note = ""
    text: Note = ""


NOTES: dict[str, type[BaseModel]] = {"notes": NotesPart}
