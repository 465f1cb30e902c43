"""A trip is kept until somebody acknowledges it, and the acknowledgement says who and when."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from twin.commands.latch import latch, latched, refuse_latched, reset
from twin.errors import InputError


def test_it_holds_until_it_is_reset(tmp_path: Path) -> None:
    refuse_latched("st3", tmp_path)
    latch("st3", "following error: 21 mm", Path("runs/a.mcap"), tmp_path)
    refuse_latched("other", tmp_path)
    for _ in range(2):
        with pytest.raises(InputError, match=r"following error: 21 mm; runs/a.mcap.*--reset"):
            refuse_latched("st3", tmp_path)
    said = reset("st3", "Ana", tmp_path)
    assert said is not None
    assert re.fullmatch(r"Ana acknowledged at \d{4}-\d\d-\d\dT[\d:]+\+00:00: st3 was stopped by a trip at .*", said)
    refuse_latched("st3", tmp_path)
    assert reset("st3", "Ana", tmp_path) is None


@pytest.mark.parametrize("text", ["", "{}", "[1]", '{"device": 3}', "\x00"])
def test_a_damaged_latch_still_holds(tmp_path: Path, text: str) -> None:
    (tmp_path / "st3.json").write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match="st3"):
        refuse_latched("st3", tmp_path)


def test_a_folder_that_cannot_be_made(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="cannot be kept"):
        latch("st3", "x", Path("a.mcap"), tmp_path / "file")
    assert latched("st3", tmp_path) is None
