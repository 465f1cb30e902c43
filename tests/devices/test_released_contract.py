"""What every released machine inherits: it is never set for a run beyond its capacity, whatever the excitation.

The counterpart of `capacity_contract` for machines that are sent no set-points: what counts is what they are set to,
and what their base then does.
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import brentq

from devices.catalogue import CatalogueEntry, catalogue
from devices.cia301.buses import open_bus
from devices.clock import ManualClock
from excitation import Capacity, ConstantPulse, Pulse, ReleasedRun, clip
from excitation.limits import Limit
from tests.devices.capacity_contract import LIMITS, NEAR, SHAPES, Case, cases

PAYLOAD = 2.5
RELEASED = {name: entry for name, entry in catalogue().items() if entry.capacity.machine is not None}
OWN = [
    (entry, case)
    for entry in RELEASED.values()
    for case in cases(entry.capacity)
    if case.kind in (entry.capacity.kinds or ())
]
each = pytest.mark.parametrize(("entry", "case"), OWN, ids=[f"{e.name}-{c.kind}-{c.limit}" for e, c in OWN])


def within(capacity: Capacity, run: ReleasedRun) -> None:
    """Compare the base's own motion with the capacity; the end stop's blow is none of the machine's doing."""
    pulse = run.pulse
    assert pulse.peak_acceleration <= capacity.acceleration * (1.0 + 1e-9)
    assert run.peak_velocity <= capacity.velocity * (1.0 + 1e-9)
    assert run.travel <= capacity.stroke * (1.0 + 1e-9)


def check(entry: CatalogueEntry, pulse: Pulse) -> tuple[bool, tuple[Limit, ...]]:
    """Clip, set and emulate a pulse; return whether it is given as asked, and which limits it passed."""
    capacity = entry.capacity
    machine = capacity.machine
    assert machine is not None
    clipped = clip(pulse, capacity, payload=PAYLOAD)
    if clipped.given is None:
        assert clipped.limits
        with pytest.raises(ValueError, match=capacity.name):
            machine.settings_for(pulse, capacity, payload=PAYLOAD, coast=0.0)
        return False, clipped.limits
    settings = machine.settings_for(clipped.given, capacity, payload=PAYLOAD, coast=0.0)
    run = ReleasedRun(machine, settings.pulse, wait=0.01, rest=0.01)
    within(capacity, run)
    with open_bus("virtual", "released contract") as bus:
        emulator = entry.emulator(
            bus, rng=np.random.default_rng(1), settings=settings, payload=PAYLOAD, clock=ManualClock()
        )
    plant = emulator.plant
    plant.release()
    seen = [(0.0, 0.0)]
    while not plant.at_rest:
        plant.advance()
        seen.append((plant.position, plant.velocity))
    positions, velocities = np.array(seen).T
    assert np.ptp(positions) <= capacity.stroke * (1.0 + 1e-9)
    assert np.abs(velocities).max() <= capacity.velocity * (1.0 + 1e-9)
    return clipped.given is pulse, clipped.limits


@each
@pytest.mark.parametrize("share", [1.0 - NEAR, 1.0])
def test_at_a_limit_and_just_below(entry: CatalogueEntry, case: Case, share: float) -> None:
    as_asked, limits = check(entry, case.pulse(share))
    # A machine has limits of its own beside those of its capacity; nothing else may stand in the way.
    assert as_asked or limits[0].name in {"gap", "drop", "acceleration"}


@each
def test_just_above_a_limit(entry: CatalogueEntry, case: Case) -> None:
    as_asked, limits = check(entry, case.pulse(1.0 + NEAR))
    assert not as_asked
    assert case.limit in {limit.name for limit in limits}


@pytest.mark.parametrize("entry", RELEASED.values(), ids=list(RELEASED))
@pytest.mark.parametrize("kind", sorted(SHAPES))
def test_other_kinds_are_refused_in_one_sentence(entry: CatalogueEntry, kind: str) -> None:
    if kind in (entry.capacity.kinds or ()):
        pytest.skip("the machine makes these")
    clipped = clip(SHAPES[kind](0.1, 2.0), entry.capacity, payload=PAYLOAD, brake=1.0)
    assert clipped.given is None
    assert clipped.limits[0].name == "kind"
    assert "\n" not in clipped.limits[0].sentence


def test_the_limits_are_met() -> None:
    met = {name: {case.limit for entry, case in OWN if entry.name == name} for name in RELEASED}
    assert met["air_track"] == set(LIMITS)
    assert met["roori1"] >= {"velocity", "stroke"}
    # Drop and gap come before the stroke is used up without a coast.
    reached = {(entry.name, case.limit) for entry, case in OWN if check(entry, case.pulse(1.0))[0]}
    assert reached == {("air_track", "velocity"), ("air_track", "acceleration"), ("roori1", "velocity")}


def test_the_stroke_binds_a_long_coast() -> None:
    capacity = RELEASED["air_track"].capacity
    machine = capacity.machine
    assert machine is not None

    def travel(coast: float) -> float:
        return ReleasedRun(machine, ConstantPulse(2.5, 0.12), coast=coast).travel

    most = brentq(lambda coast: travel(coast) - capacity.stroke, 1.0, 14.0, xtol=1e-13)
    for coast, fits in ((most * (1.0 - NEAR), True), (most * (1.0 + NEAR), False)):
        clipped = clip(ConstantPulse(2.5, 0.12), capacity, payload=PAYLOAD, coast=coast)
        assert clipped.feasible is fits
        assert clipped.given is not None
        settings = machine.settings_for(clipped.given, capacity, payload=PAYLOAD, coast=coast)
        within(capacity, ReleasedRun(machine, settings.pulse, coast=coast))
