"""Edge contact against full contact; words, JSON, scene lines and pictures of a calibration."""

from __future__ import annotations

import json
import re
import tomllib
from pathlib import Path

import pytest

from tests.facts import B6L
from tests.twin.calibration.rockings import rocking
from twin.calibration.calibrate import Calibration, calibrate
from twin.calibration.contact import Contact, compare_contact
from twin.calibration.picture import draw_calibration
from twin.calibration.words import data, lines, scene_lines
from twin.errors import InputError
from twin.rocking.restitution import Improved

MATERIAL, PLACE = 0.985, 0.7


@pytest.fixture(scope="module")
def full() -> Calibration:
    recording = rocking(B6L, 0.16, MATERIAL * Improved(PLACE).ratio(B6L), held=0.2, noise=1e-4)
    return calibrate(recording.time, recording.rotation, nominal=B6L)


@pytest.fixture(scope="module")
def contact(full: Calibration) -> Contact:
    recording = rocking(B6L, 0.16, MATERIAL * B6L.housner_restitution, held=0.2, noise=1e-4, seed=1)
    return compare_contact(full, calibrate(recording.time, recording.rotation))


def test_material_and_base_are_told_apart(contact: Contact) -> None:
    assert abs(contact.material.value - MATERIAL) < 4.0 * contact.material.error < 0.01
    assert abs(contact.shape.value - Improved(PLACE).ratio(B6L)) < 4.0 * contact.shape.error
    assert abs(contact.k.value - PLACE) < 4.0 * contact.k.error < 0.2


def test_lines_say_it_with_intervals(full: Calibration, contact: Contact) -> None:
    said = lines(full, contact)
    heads = [line[:11].strip() for line in said]
    for head in ("fitted", "eta", "Housner", "improved", "slender", "frequency", "size", "tilt", "edge", "material"):
        assert head in heads
    assert all(len(line[:11]) == 11 for line in said)
    assert re.search(r"eta        0\.9\d+ \(0\.9\d+ to 0\.9\d+\)", "\n".join(said))
    assert said[-1] == "verdict    rocks as a rigid block"


def test_json_is_json(full: Calibration, contact: Contact) -> None:
    said = json.loads(json.dumps(data(full, contact), allow_nan=False))
    assert said["estimates"]["restitution"]["low"] < MATERIAL * Improved(PLACE).ratio(B6L)
    assert len(said["impacts"]) == full.restitution.ratio.size


def test_scene_lines_are_toml(full: Calibration) -> None:
    scene = tomllib.loads("\n".join(scene_lines(full)))
    assert scene["block"]["width_mm"] == pytest.approx(60.0, rel=0.01)
    assert scene["block"]["height_mm"] == pytest.approx(270.0, rel=0.01)
    assert set(scene["uncertainty"]) == {"restitution", "slenderness_percent", "size_percent"}


@pytest.mark.parametrize("ending", ["png", "svg", "pdf"])
def test_pictures(full: Calibration, contact: Contact, tmp_path: Path, ending: str) -> None:
    path = tmp_path / f"fit.{ending}"
    draw_calibration(full, path, "B6L", contact)
    assert path.stat().st_size > 10_000


def test_a_picture_of_another_kind_is_refused(full: Calibration, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"\.png, \.svg or \.pdf"):
        draw_calibration(full, tmp_path / "fit.bmp", "B6L")
