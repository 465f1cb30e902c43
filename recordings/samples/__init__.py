"""Small recordings that ship with the package; `python -m tests.recordings.make_recordings` makes them anew."""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path

DESCRIPTIONS = {
    "sine": "B6L under one full sine of 0.32 g and 5 Hz on the emulated ST-III: it rocks and comes to rest",
    "free": "B6L let go from 6 degrees on a still table: free rocking",
    "fall": "B6L under one full sine of 0.45 g and 3 Hz: it overturns",
}
"""What each sample shows; the first is played where none is named."""


def sample_names() -> list[str]:
    """Return the names of the samples."""
    return list(DESCRIPTIONS)


def sample_path(name: str) -> Path:
    """Return the file of a sample. The package is always installed as files: numba's cache wants that too."""
    return Path(str(files("recordings.samples") / f"{name}.mcap"))
