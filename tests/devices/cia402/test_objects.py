"""The servo drive's objects: what its EDS declares, and what each of them makes the drive do."""

from __future__ import annotations

import itertools
import re

import pytest
from canopen.objectdictionary import ODVariable

from devices.cia301.dictionary import NO_OBJECT, TOO_HIGH, TOO_LOW, WRONG_STATE, WRONG_VALUE, ObjectStore, load_eds
from devices.cia402 import states
from devices.cia402.states import State
from devices.cia402.units import SERVO_DRIVE, units_of
from devices.errors import EdsError
from tests.devices.cia402.conftest import CAPACITY, NM, Bench, H
from tests.devices.cia402.rail import Rail


def test_the_eds_is_whole() -> None:
    """Every listed object has its section, every section is listed, and sub-numbers are those there are (CiA 306)."""
    listed = set(re.findall(r"^\d+=0x([0-9A-F]{4})$", SERVO_DRIVE, re.MULTILINE))
    sections = set(re.findall(r"^\[([0-9A-F]{4})\]$", SERVO_DRIVE, re.MULTILINE))
    assert listed == sections
    dictionary = load_eds(SERVO_DRIVE, 1)
    for index in dictionary:
        entry = dictionary[index]
        if not isinstance(entry, ODVariable):
            (told,) = re.findall(rf"^\[{index:04X}\]\n.*\n.*\nSubNumber=(\d+)$", SERVO_DRIVE, re.MULTILINE)
            assert int(told) == len(entry)


def test_every_object_has_a_value_inside_its_limits() -> None:
    objects = ObjectStore(SERVO_DRIVE, 1)
    for index in objects.object_dictionary:
        entry = objects.object_dictionary[index]
        for variable in [entry] if isinstance(entry, ODVariable) else [entry[sub] for sub in entry]:
            if variable.fixed_size:
                value = objects.get(index, variable.subindex)
                assert variable.min is None or value >= variable.min
                assert variable.max is None or value <= variable.max


def test_what_the_pdos_carry_is_what_the_frames_pack() -> None:
    objects = ObjectStore(SERVO_DRIVE, 3)
    mapped = {
        index: [objects.get(index, sub) for sub in range(1, objects.get(index) + 1)]
        for index in (0x1600, 0x1A00, 0x1A01)
    }
    assert mapped == {0x1600: [0x60400010, 0x607A0020], 0x1A00: [0x60410010, 0x60640020], 0x1A01: [0x21000020]}
    assert [objects.get(index, 1) & 0x7FF for index in (0x1400, 0x1800, 0x1801)] == [0x203, 0x183, 0x283]
    assert {objects.get(index, 2) for index in (0x1400, 0x1800, 0x1801)} == {1}
    for entry in itertools.chain(*mapped.values()):
        assert objects.object_dictionary[entry >> 16].pdo_mappable


@pytest.mark.parametrize(
    ("was", "told"),
    [
        ("0xF7010000", "F7020000"),
        ("0xFA010300", "FA014800"),
        ("0xFA015700", "FA010300"),
    ],
)
def test_units_that_are_no_metres_and_seconds_are_refused(was: str, told: str) -> None:
    with pytest.raises(EdsError, match=f"tells {told} as unit of"):
        units_of(SERVO_DRIVE.replace(was, "0x" + told))


def test_units_come_from_the_eds_alone() -> None:
    coarse = SERVO_DRIVE.replace("0xF7010000", "0xFA010000").replace("0xFA015700", "0xFD015700")
    assert units_of(coarse) == (1e-6, 1e-6, 1e-3)
    assert units_of(SERVO_DRIVE) == (1e-9, 1e-6, 1e-6)


def test_values_that_are_alive() -> None:
    bench = Bench(0.05).up()
    bench.to_speed(0.1)
    assert bench.get(0x6041) == bench.drive.statusword
    assert bench.get(0x6061) == 8
    assert bench.get(0x6064) == round(bench.rail.position / NM)
    assert bench.get(0x607A) == round(bench.x / NM)
    assert bench.get(0x6040) == states.ENABLE_OPERATION
    assert bench.get(0x2100) == 1_500_000
    assert bench.get(0x60F4) == 0
    bench.rail.position += 3e-3
    bench.drive.axis.measured = bench.rail.position
    assert bench.get(0x60F4) == pytest.approx(-3_000_000, abs=1)


def test_power_on_values_are_the_options() -> None:
    bench = Bench(stop_deceleration=2.5, patience=7, start_window=5e-6, following_error=1e-3, following_time=0.004)
    assert [bench.get(index) for index in (0x6085, 0x2010, 0x2011, 0x6065, 0x6066)] == [
        2_500_000,
        7,
        5000,
        1_000_000,
        4,
    ]
    assert bench.get(0x1017) == 100


@pytest.mark.parametrize(
    ("index", "sub", "value", "code"),
    [
        (0x1006, 0, 499, TOO_LOW),
        (0x1006, 0, 4001, TOO_HIGH),
        (0x2010, 0, 201, TOO_HIGH),
        (0x2011, 0, 20001, TOO_HIGH),
        (0x605A, 0, 3, WRONG_VALUE),
        (0x605E, 0, 0, TOO_LOW),
        (0x6060, 0, 1, WRONG_VALUE),
        (0x6098, 0, 1, WRONG_VALUE),
        (0x607C, 0, 200_000_001, WRONG_VALUE),
        (0x6085, 0, 0, TOO_LOW),
    ],
)
def test_what_is_not_taken(index: int, sub: int, value: int, code: int) -> None:
    bench = Bench()
    before = bench.get(index, sub)
    assert bench.set(index, value, sub) == code
    assert bench.get(index, sub) == before


def test_objects_that_are_not_there() -> None:
    bench = Bench()
    bench.drive.receive(0x601, bytes.fromhex("4099990000000000"))
    assert int.from_bytes(bench.sent.pop()[1][4:], "little") == NO_OBJECT


@pytest.mark.parametrize("code", [1, 2])
def test_the_quick_stop_uses_the_ramp_that_is_set(code: int) -> None:
    bench = Bench()
    bench.set(0x6085, 4_000_000)
    bench.set(0x6084, 2_000_000)
    assert bench.set(0x605A, code) == 0
    bench.up().to_speed(0.3)
    bench.cycle(states.QUICK_STOP)
    speeds = bench.run_down(states.QUICK_STOP)
    braking = [(a - b) / H for a, b in itertools.pairwise(speeds)]
    assert max(braking) == pytest.approx(4.0 if code == 2 else 2.0, rel=1e-3)
    assert bench.drive.state is State.SWITCH_ON_DISABLED
    assert bench.rail.powers[-1] is False


@pytest.mark.parametrize("code", [5, 6])
def test_a_quick_stop_may_end_with_power(code: int) -> None:
    bench = Bench()
    bench.set(0x605A, code)
    bench.up().to_speed(0.1)
    bench.cycle(states.QUICK_STOP)
    bench.run_down(states.QUICK_STOP)
    assert bench.drive.state is State.QUICK_STOP_ACTIVE
    assert bench.rail.powered
    bench.cycle(states.QUICK_STOP)
    assert bench.drive.at_ease
    # transition 16
    bench.cycle(states.ENABLE_OPERATION)
    assert bench.drive.state is State.OPERATION_ENABLED
    bench.x, bench.v = bench.drive.axis.measured, 0.0
    bench.to_speed(0.05)
    bench.cycle(states.QUICK_STOP)
    bench.cycle(states.ENABLE_OPERATION)
    assert bench.drive.state is State.QUICK_STOP_ACTIVE  # not while it moves
    bench.cycle(states.DISABLE_VOLTAGE)
    assert bench.drive.state is State.SWITCH_ON_DISABLED


@pytest.mark.parametrize(("code", "ramp"), [(1, 2.0), (2, 4.0)])
def test_the_fault_reaction_uses_the_ramp_that_is_set(code: int, ramp: float) -> None:
    bench = Bench()
    for index, value in ((0x6085, 4_000_000), (0x6084, 2_000_000), (0x605E, code)):
        bench.set(index, value)
    bench.up().to_speed(0.3)
    bench.drive.fail(0x7500)
    assert bench.emergencies == [0x7500]
    assert bench.get(0x603F) == 0x7500
    speeds = bench.run_down()
    assert max((a - b) / H for a, b in itertools.pairwise(speeds)) == pytest.approx(ramp, rel=1e-3)
    assert bench.drive.state is State.FAULT
    bench.up()
    assert bench.get(0x603F) == 0


def near_the_end(bench: Bench, target: float) -> None:
    """Creep to a target slowly enough for every limit but the stroke's."""
    while bench.drive.state is State.OPERATION_ENABLED and bench.x != target:
        bench.x = target if abs(target - bench.x) < 2e-6 else bench.x + (1e-6 if target > bench.x else -1e-6)
        bench.cycle(states.ENABLE_OPERATION, bench.x)


@pytest.mark.parametrize(
    ("index", "sub", "value", "fine", "beyond", "code"),
    [
        (0x607F, 0, 50_000, lambda b: b.to_speed(0.05, 5.0), lambda b: b.to_speed(0.0501, 0.05), 0x8400),
        (0x60C5, 0, 1_000_000, lambda b: b.to_speed(0.1, 1.0), lambda b: b.to_speed(0.2, 1.01), 0x8500),
        (0x607D, 2, 100_000, lambda b: near_the_end(b, 1e-4), lambda b: near_the_end(b, 1.00002e-4), 0x8612),
        (0x607D, 1, -100_000, lambda b: near_the_end(b, -1e-4), lambda b: near_the_end(b, -1.00002e-4), 0x8612),
    ],
)
def test_limits_narrow_what_the_machine_can_do(index, sub, value, fine, beyond, code) -> None:
    bench = Bench()
    assert bench.set(index, value, sub) == 0
    bench.up()
    fine(bench)
    assert bench.emergencies == []
    beyond(bench)
    assert bench.emergencies == [code]
    assert bench.drive.statusword & states.INTERNAL_LIMIT


@pytest.mark.parametrize(
    ("index", "sub", "value"), [(0x607F, 0, 2**32 - 1), (0x60C5, 0, 2**32 - 1), (0x607D, 2, 2**31 - 1)]
)
def test_limits_never_widen_it(index: int, sub: int, value: int) -> None:
    bench = Bench()
    assert bench.set(index, value, sub) == 0
    bench.up()
    limits = bench.drive.interpolator.limits
    assert (limits.upper, limits.top_velocity, limits.top_acceleration) == (0.1, 0.5, 10.0)


def test_limits_written_under_way_wait_for_the_next_enabling() -> None:
    bench = Bench().up().to_speed(0.3)
    assert bench.set(0x607F, 50_000) == 0
    bench.to_speed(0.4)
    bench.to_speed(0.0)
    bench.cycle(states.DISABLE_VOLTAGE)
    bench.up()
    assert bench.drive.interpolator.limits.top_velocity == pytest.approx(0.05)


@pytest.mark.parametrize("cycle_time", [500, 1000, 4000])
def test_the_cycle_can_be_set_from_250_hz_to_2_khz(cycle_time: int) -> None:
    bench = Bench()
    assert bench.set(0x1006, cycle_time) == 0
    assert bench.rail.cycle_time == pytest.approx(1e-6 * cycle_time)
    bench.up()
    # the capacity's acceleration in that cycle, and a little more
    h = 1e-6 * cycle_time
    bench.cycle(states.ENABLE_OPERATION, CAPACITY.acceleration * h * h)
    assert bench.emergencies == []
    bench.cycle(states.ENABLE_OPERATION, 3.02 * CAPACITY.acceleration * h * h)
    assert bench.emergencies == [0x8500]


def test_the_cycle_is_not_changed_under_way_nor_where_the_machine_cannot() -> None:
    bench = Bench().up()
    assert bench.set(0x1006, 2000) == WRONG_STATE
    assert bench.set(0x1006, 1000) == 0


class Fixed(Rail):
    """A rail whose cycle cannot be set."""

    pace = None


def test_a_machine_whose_cycle_is_fixed_says_so() -> None:
    bench = Bench(rail=Fixed)
    assert bench.set(0x1006, 2000) == WRONG_VALUE
    assert bench.set(0x1006, 1000) == 0
    assert bench.get(0x1006) == 1000


def test_a_controlword_by_sdo_is_obeyed_at_the_next_sync() -> None:
    bench = Bench()
    for word in (states.SHUTDOWN, states.SWITCH_ON, states.ENABLE_OPERATION):
        assert bench.set(0x6040, word) == 0
        bench.sync()
    assert bench.drive.state is State.OPERATION_ENABLED
    assert bench.set(0x607A, 5000) == 0
    assert bench.set(0x6040, states.ENABLE_OPERATION) == 0
    bench.sync()
    bench.sync()
    assert bench.rail.position == pytest.approx(5e-6)


def test_modes_change_only_at_rest() -> None:
    bench = Bench().up().to_speed(0.1)
    assert bench.set(0x6060, 6) == WRONG_STATE
    bench.to_speed(0.0)
    bench.cycle(states.ENABLE_OPERATION, bench.x)
    assert bench.set(0x6060, 6) == 0
    assert bench.get(0x6061) == 6
    bench.cycle(states.ENABLE_OPERATION)
    assert bench.drive.state is State.OPERATION_ENABLED
    # back again, from where it stands and nowhere else
    assert bench.set(0x6060, 8) == 0
    bench.cycle(states.ENABLE_OPERATION, bench.drive.axis.measured + 30e-6)
    assert bench.emergencies == [0x8611]
