"""The contract of `capacity_contract` for every device that follows set-points: none beyond its capacity."""

from __future__ import annotations

import numpy as np
import pytest

from devices.catalogue import CatalogueEntry, catalogue
from excitation import Capacity, Motion, SineWave
from tests.devices.capacity_contract import (
    LIMITS,
    NEAR,
    SHAPES,
    Case,
    H,
    cases,
    check_beyond,
    check_just_above,
    check_within,
    perform,
    violations,
)

SERVOS = [entry for entry in catalogue().values() if entry.has_driver and entry.capacity.machine is None]
EVERY = [(entry, case) for entry in SERVOS for case in cases(entry.capacity)]
each = pytest.mark.parametrize(("entry", "case"), EVERY, ids=[f"{e.name}-{c.kind}-{c.limit}" for e, c in EVERY])


def test_every_kind_meets_every_limit() -> None:
    assert [entry.name for entry in SERVOS] == ["quanser_st3"]
    met = {(case.kind, case.limit) for _, case in EVERY}
    assert met == {(kind, limit) for kind in SHAPES for limit in LIMITS}


@each
@pytest.mark.parametrize("share", [1.0 - NEAR, 1.0])
def test_at_a_limit_and_just_below(entry: CatalogueEntry, case: Case, share: float) -> None:
    check_within(entry, case, share)


@each
def test_just_above_a_limit(entry: CatalogueEntry, case: Case) -> None:
    check_just_above(case)


@each
def test_beyond_a_limit(entry: CatalogueEntry, case: Case) -> None:
    check_beyond(entry, case)


def test_the_contract_can_be_broken() -> None:
    """A machine that was given too much is found out, in each limit."""
    capacity = Capacity(name="bench", stroke=0.2, velocity=0.5, acceleration=10.0)
    t = np.arange(0.0, 0.5, H)
    assert violations(0.099 * np.sin(4.0 * t), capacity) == []
    assert [text.split()[0] for text in violations(0.101 * np.sin(4.0 * t), capacity)] == ["stroke"]
    assert [text.split()[0] for text in violations(0.09 * np.sin(6.0 * t), capacity)] == ["velocity"]
    assert [text.split()[0] for text in violations(0.011 * np.sin(31.0 * t), capacity)] == ["acceleration"]


def test_what_reaches_the_machine_is_what_was_sent() -> None:
    entry = SERVOS[0]
    motion = Motion(SineWave(2.0, 4.0), 1.0, settle=0.1)
    done = perform(entry, entry.capacity, motion)
    sent = motion.displacement(np.arange(1, round(motion.duration / H)) * H)
    first = int(np.argmax(done.setpoints != done.setpoints[0]))
    begun = int(np.argmax(np.round(sent, 9) != 0.0))
    middle = slice(begun, begun + 200)
    assert done.setpoints[first : first + 200] == pytest.approx(sent[middle], abs=1e-9)
