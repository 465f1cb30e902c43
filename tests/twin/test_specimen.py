"""The emulated block that leans as the pulse begins."""

from __future__ import annotations

import math

import pytest

from devices.quanser_st3.capacity import CAPACITY
from tests.twin.conftest import FREE, SINE, perform_on, short_scene
from twin.errors import InputError
from twin.rehearsal import rehearse
from twin.rocking.block import Block
from twin.scene import Scene
from twin.scene_parts import SpecimenPart
from twin.specimen import Specimen, specimen_of

TILT = math.radians(0.5)


def leaning(excitation: str = SINE) -> Scene:
    scene = short_scene(excitation)
    part = SpecimenPart(tilt_at_pulse_deg=0.5, rotation_noise_rad=0.0)
    return scene.model_copy(update={"table": scene.table.model_copy(update={"specimen": part})})


def test_it_leans_once_and_is_let_go() -> None:
    specimen = Specimen(Block(0.06, 0.27), 0.9, 0.0, tilt=TILT, tilted_at=0.0995)
    for _ in range(2):
        seen = [specimen(1e-3, 0.0, 0.0) for _ in range(3000)]
        assert seen[:99] == [0.0] * 99
        assert seen[99] == TILT
        assert 0.0 < seen[110] < TILT
        assert specimen.resting
        assert not specimen.overturned
        specimen.set_up()


def test_it_leans_as_the_pulse_begins() -> None:
    scene = leaning('kind = "sine"\namplitude_g = 0.1\nfrequency_hz = 4')
    start = rehearse(scene, CAPACITY).motion.pulse_start
    _, kept = perform_on(scene)
    assert max(abs(record.rotation) for record in kept.cycles if record.time < start - 0.005) == 0.0
    first = next(record for record in kept.cycles if record.rotation != 0.0)
    # The block's clock starts two cycles before the run's, with the table's power.
    assert first.time == pytest.approx(start, abs=0.005)
    assert first.rotation == pytest.approx(TILT, abs=1e-4)


def test_the_pulse_begins_where_its_clipped_motion_has_it() -> None:
    scene = leaning('kind = "sine"\namplitude_g = 0.5\nfrequency_hz = 1.5')
    assert rehearse(scene, CAPACITY).clipped.limits  # type: ignore[union-attr]
    specimen = specimen_of(scene, CAPACITY)
    cycles = next(k for k in range(1, 10_000) if specimen(1e-3, 0.0, 0.0))
    assert cycles * 1e-3 == pytest.approx(rehearse(scene, CAPACITY).motion.pulse_start, abs=1.1e-3)


def test_nothing_leans_unless_told() -> None:
    assert short_scene().table.specimen.tilt_at_pulse_deg == 0.0
    specimen = specimen_of(short_scene(), CAPACITY)
    assert all(specimen(0.01, 0.0, 0.0) == 0.0 for _ in range(500))


def test_without_a_pulse_there_is_no_such_instant() -> None:
    with pytest.raises(InputError, match="tilt_at_pulse_deg: there is no pulse"):
        specimen_of(leaning(FREE), CAPACITY)
