"""How far a campaign has got, kept beside its recordings, so that the next call goes on where it stopped."""

from __future__ import annotations

import os
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from twin.campaign import Campaign, Step
from twin.errors import InputError, sentence
from twin.text_file import read_text

FILE = "progress.json"
Text = Annotated[str, Field(max_length=2000)]
Number = Annotated[float, Field(allow_inf_nan=False)]


class _Kept(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")


class Entry(_Kept):
    """What became of one run of the table.

    `done`: performed to its end, whether the block fell or not. Otherwise the next call makes it again.
    """

    number: Annotated[int, Field(ge=1)]
    run: Text
    level_percent: Number
    digest: Text
    time: Text
    ended: Literal["performed", "fell", "tripped", "not recorded whole"]
    predicted: Text
    measured: Text
    predicted_peak_rad: Number | None = None
    measured_peak_rad: Number | None = None
    tripped: Text | None = None
    recording: Text

    @property
    def done(self) -> bool:
        """Whether the run was performed to its end and recorded."""
        return self.ended in ("performed", "fell")


class UnderWay(_Kept):
    """A run that was begun; where it is found later, nobody wrote down how it ended."""

    number: Annotated[int, Field(ge=1)]
    time: Text
    recording: Text


class Progress(_Kept):
    """Every run of the table so far, in the order they were made, and the one under way."""

    campaign: Text
    entries: Annotated[tuple[Entry, ...], Field(max_length=100_000)] = ()
    under_way: UnderWay | None = None

    @property
    def done(self) -> int:
        """How many steps of the campaign are done."""
        return sum(entry.done for entry in self.entries)

    def begun(self, step: Step, recording: Path) -> Progress:
        """Return it with a step under way."""
        way = UnderWay(number=step.number, time=now(), recording=str(recording)[-2000:])
        return self.model_copy(update={"under_way": way})

    def ended(self, entry: Entry | None) -> Progress:
        """Return it with nothing under way, and `entry` behind the others."""
        entries = self.entries if entry is None else (*self.entries, entry)
        return self.model_copy(update={"under_way": None, "entries": entries})


def load_progress(folder: Path, campaign: Campaign) -> Progress:
    """Return how far the campaign has got in `folder`.

    Raises
    ------
    InputError
        One sentence: the file is damaged, or what was performed is no longer what the campaign says.
    """
    path = folder / FILE
    if not path.exists():
        return Progress(campaign=campaign.name)
    try:
        progress = Progress.model_validate_json(read_text(path))
    except ValidationError as error:
        raise InputError(f"{sentence(error, str(path), lambda _: list(Progress.model_fields))}; {_AGAIN}") from None
    done = [entry for entry in progress.entries if entry.done]
    for k, entry in enumerate(done):
        step = campaign.steps[k] if k < len(campaign.steps) else None
        if step is None or step.digest != entry.digest:
            raise InputError(
                f"{path}: run {entry.number}, {entry.run} at {entry.level_percent:g} %, was performed, and campaign "
                f"{campaign.name} no longer has it there; {_AGAIN}"
            )
    return progress


_AGAIN = "--restart begins again, --out takes another folder"


def save_progress(folder: Path, progress: Progress) -> None:
    """Write it, all or nothing; an `InputError` where it cannot be."""
    path = folder / FILE
    beside = path.with_name(FILE + ".tmp")
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with beside.open("w", encoding="utf-8") as file:
            file.write(progress.model_dump_json(indent=2) + "\n")
            file.flush()
            os.fsync(file.fileno())
        beside.replace(path)
    except OSError as error:
        raise InputError(f"{path} cannot be written: {(error.strerror or str(error)).lower()}") from None


def set_aside(folder: Path) -> Path | None:
    """Keep the progress there is under another name; return that, or None where there was none."""
    path = folder / FILE
    if not path.exists():
        return None
    kept = path.with_name(f"progress-{datetime.now(UTC):%Y%m%dT%H%M%S%f}.json")
    try:
        path.replace(kept)
    except OSError as error:
        raise InputError(f"{path} cannot be set aside: {(error.strerror or str(error)).lower()}") from None
    return kept


def now() -> str:
    """Return the time, ISO 8601 in UTC."""
    return datetime.now(UTC).isoformat(timespec="seconds")
