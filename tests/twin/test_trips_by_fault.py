"""Every trip is caused by the fault that causes it, and the recording says cause, time, action and how it ended."""

from __future__ import annotations

import pytest

from devices.faults.catalogue import parse_fault
from devices.quanser_st3.capacity import CAPACITY
from tests.twin.conftest import Kept, perform_on, short_scene
from tests.twin.fault_run import suffer
from twin.live_loop import Ends
from twin.rehearsal import rehearse
from twin.scene_trips import TripsPart

# At its top speed, and nothing rocks: the fault is all there is.
SCENE = short_scene('kind = "cosine"\namplitude_g = 0.18\nfrequency_hz = 1\ncycles = 4')
AT = round(rehearse(SCENE, CAPACITY).motion.pulse_start + 2.25, 3)
CAUSES = [
    ("following_error", "following_error"),
    ("host_stall:0.15", "overrun"),
    ("node_silent", "connection"),
    ("heartbeat_lost", "connection"),
    ("second_master", "connection"),
    ("encoder_frozen", "sensor"),
    ("accelerometer_stuck", "sensor"),
    ("accelerometer_saturated", "sensor"),
    ("drive_fault", "drive"),
    ("emergency_stop", "drive"),
    ("limit_switch", "drive"),
    ("operator_stop", "operator"),
]


@pytest.mark.parametrize(("fault", "name"), CAUSES)
def test_a_fault_causes_its_trip(fault: str, name: str) -> None:
    kind, colon, size = fault.partition(":")
    found = suffer(SCENE, parse_fault(f"{kind}@{AT}{colon}{size}"))
    report = found.report
    stopping = [trip for trip in report.trips if trip.stops]
    assert name in [trip.name for trip in report.trips], report.trips
    assert stopping
    assert report.tripped is not None
    said = [event for event in found.kept.events if event.name == "trip"]
    assert any(event.message.startswith(f"{name}: ") and "ramped down" in event.message for event in said)
    assert found.kept.events[-1].name in ("stopped", "stop failed")
    assert abs(stopping[0].time - AT) < 1.0


def kept_of(scene_trips: TripsPart, **watch: object) -> Kept:
    scene = short_scene().model_copy(update={"trips": scene_trips})
    report, kept = perform_on(scene, **watch)
    assert report.tripped is not None
    return kept


def test_a_scene_may_cut_the_power_instead() -> None:
    trips = TripsPart.model_validate({"operator": {"action": "cut_power"}})
    seen: list[int] = []

    def stopped() -> Ends | None:
        seen.append(1)
        return Ends("operator", "enough") if len(seen) > 2250 else None

    kept = kept_of(trips, stopped=stopped)
    (trip,) = [event for event in kept.events if event.name == "trip"]
    assert trip.message == "operator: enough; the power is cut"
    assert kept.events[-1].name == "stopped"
    assert abs(kept.cycles[-1].position - kept.cycles[-2].position) < 1e-5
    numbers = [record.cycle for record in kept.cycles]
    assert numbers == sorted(set(numbers))


def test_what_is_indicated_does_not_stop() -> None:
    trips = TripsPart.model_validate({"rotation": {"limit_alpha": 0.05}})
    scene = short_scene().model_copy(update={"trips": trips})
    report, kept = perform_on(scene)
    assert report.tripped is None
    assert [trip.name for trip in report.trips] == ["rotation"]
    (event,) = [event for event in kept.events if event.name == "trip"]
    assert event.level == "warning"
    assert event.message.endswith("indicated")
