"""What can be asked for, and what is refused in one sentence."""

from __future__ import annotations

import math

import pytest

from devices.errors import FaultRefused
from devices.faults.catalogue import FAULTS, find_fault, parse_fault
from devices.faults.fault import fault_of

ASKED_FOR = {
    "lost SYNC": ["sync_lost"],
    "late SYNC": ["sync_late"],
    "dropped / duplicated / reordered / corrupted frames": [
        "frames_dropped",
        "frames_duplicated",
        "frames_reordered",
        "frames_corrupted",
    ],
    "silent node": ["node_silent"],
    "heartbeat lost (either side)": ["heartbeat_lost", "host_heartbeat_lost"],
    "bus-off": ["bus_off", "host_bus_off"],
    "error frames": ["error_frames"],
    "full receive queue": ["receive_queue_full"],
    "encoder glitch and freeze": ["encoder_glitch", "encoder_frozen"],
    "accelerometer stuck, saturated or biased": [
        "accelerometer_stuck",
        "accelerometer_saturated",
        "accelerometer_biased",
    ],
    "following error": ["following_error"],
    "limit switch": ["limit_switch"],
    "drive fault": ["drive_fault"],
    "emergency stop": ["emergency_stop"],
    "host killed (-9) in mid run": ["host_killed"],
    "emulator killed": ["emulator_killed"],
    "a second master on the bus": ["second_master", "foreign_nmt", "host_number_taken"],
    "host stall (a late cycle)": ["host_stall"],
    "over-capacity set-point injected below the planner": ["setpoint_on_bus", "setpoint_in_exchange"],
    "specimen pushed": ["specimen_pushed"],
    "operator stop": ["operator_stop"],
}
"""The issue's own words, and what they are called here."""


def test_every_fault_asked_for_is_there() -> None:
    assert sorted(name for names in ASKED_FOR.values() for name in names) == sorted(FAULTS)


@pytest.mark.parametrize("name", FAULTS)
def test_each_is_described_and_its_own_default_is_inside_its_bounds(name: str) -> None:
    kind = FAULTS[name]
    fault = fault_of(kind, 1.0)
    assert fault.name == name
    assert kind.text
    assert kind.text in kind.line
    assert kind.text in fault.sentence
    if kind.size is not None:
        assert kind.size.least <= fault.magnitude <= kind.size.most
        assert kind.size.unit in ("1", "s", "m", "m/s2", "rad/s")


def test_given_as_text() -> None:
    fault = parse_fault("host_stall@0.25:0.05")
    assert (fault.name, fault.at, fault.magnitude, fault.duration) == ("host_stall", 0.25, 0.05, 0.0)
    assert parse_fault("drive_fault@1:0x3210").magnitude == 0x3210
    assert parse_fault("encoder_frozen@1").duration == math.inf
    assert parse_fault("encoder_glitch@1").magnitude == 5e-3


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("sync_lost", "sync_lost is not NAME@SECONDS or NAME@SECONDS:VALUE"),
        ("@1", "is not NAME@SECONDS"),
        ("sync_lost@", "is not NAME@SECONDS"),
        ("sync_lost@1:", "is not NAME@SECONDS"),
        ("sync_lots@1", "did you mean sync_lost"),
        ("nonsense@1", "known are sync_lost, sync_late"),
        ("sync_lost@x", "x is no number"),
        ("sync_lost@1:y", "y is no number"),
        ("sync_lost@-1", "its time is -1 s; it must be finite and at least 0 s"),
        ("sync_lost@nan", "its time is nan s"),
        ("sync_lost@inf", "its time is inf s"),
        ("sync_lost@1:0", "frames in a row is 0; it must be 1 to 10000"),
        ("sync_lost@1:1.5", "frames in a row is 1.5; it must be a whole number"),
        ("sync_late@1:2", "delay is 2 s; it must be 0 to 1 s"),
        ("sync_late@1:nan", "delay is nan s"),
        ("limit_switch@1:0", "which end, 1 or -1 is 0; it must be a whole number but 0"),
        ("operator_stop@1:3", "operator_stop takes no value"),
    ],
)
def test_refusals(text: str, words: str) -> None:
    with pytest.raises(FaultRefused, match="fault") as refused:
        parse_fault(text)
    assert words in str(refused.value)
    assert "\n" not in str(refused.value)


def test_a_duration_belongs_to_what_lasts() -> None:
    assert fault_of(find_fault("bus_off"), 0.0, duration=0.25).duration == 0.25
    with pytest.raises(FaultRefused, match="happens in an instant"):
        fault_of(find_fault("operator_stop"), 0.0, duration=1.0)
    with pytest.raises(FaultRefused, match="its duration is 0 s"):
        fault_of(find_fault("bus_off"), 0.0, duration=0.0)
