"""Released machines from the host to the base: armed, released in their cycle, stopped as far as they can be."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from devices.air_track import capacity as air_track_capacity
from devices.air_track.driver import open_table as open_air_track
from devices.air_track.emulator import EmulatedAirTrack
from devices.cia301 import frames
from devices.cia301.buses import CanBus, open_bus
from devices.cia301.frames import NmtCommand
from devices.cia401.release import Input, Output
from devices.clock import ManualClock
from devices.errors import BusDisturbed, DeviceMismatch, DeviceNotReady, DeviceTimeout, DriveStopped, SetpointRefused
from devices.positioning import bring_to
from devices.quanser_st3.capacity import CAPACITY as ST3
from devices.released_parameters import MeasuringParameters
from devices.roori1 import capacity as roori1_capacity
from devices.roori1.driver import open_table as open_roori1
from devices.roori1.emulator import EmulatedRoori1
from excitation import ConstantPulse, DoublePulse, Motion, ReleasedRun, TableRun

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from devices.released_emulation import ReleasedEmulation
    from devices.released_table import ReleasedTable
    from devices.sample import Sample

H = 1e-3
BLOCK = 2.5692
MACHINES = {
    "air_track": (air_track_capacity.CAPACITY, open_air_track, EmulatedAirTrack, ConstantPulse(2.55, 0.12), 0.5),
    "roori1": (roori1_capacity.CAPACITY, open_roori1, EmulatedRoori1, DoublePulse(0.3, 0.02), 0.0),
}
EXACT = MeasuringParameters(release_delay=0.0, encoder_step=0.0, accelerometer_noise=0.0, accelerometer_bias=0.0)
_channels = itertools.count()


@dataclass
class Rig:
    """Host, emulator and a third tap, on a manual clock that the host's cycles move."""

    table: ReleasedTable
    emulator: ReleasedEmulation
    clock: ManualClock
    tap: CanBus
    run: TableRun

    def perform(self, until: float, first: int = 0) -> list[Sample]:
        """The planned cycles up to `until`, s."""
        samples = []
        for cycle in range(first, round(until / H)):
            self.clock.advance(H)
            samples.append(self.table.exchange(cycle, self.run.displacement((cycle + 1) * H)))
        return samples

    def heard(self) -> list[tuple[int, bytes]]:
        """Every frame since the last call."""
        return list(iter(self.tap.receive, None))

    def outputs(self) -> list[int]:
        """What the host wrote to the release device since the last call."""
        return [data[0] for identifier, data in self.heard() if identifier == 0x201]


@pytest.fixture
def make_rig() -> Iterator[Callable[..., Rig]]:
    buses: list[CanBus] = []

    def make(name: str, *, parameters: MeasuringParameters = EXACT, open_options: Any = None, **options: Any) -> Rig:
        capacity, open_table, emulator_of, pulse, coast = MACHINES[name]
        channel = f"released {next(_channels)}"
        host, node, tap = (open_bus("virtual", channel) for _ in range(3))
        buses.extend((host, node, tap))
        clock = ManualClock()
        settings = capacity.machine.settings_for(pulse, capacity, payload=BLOCK, coast=coast)
        options.setdefault("specimen", lambda *_: 0.0)
        emulator = emulator_of(
            node,
            rng=np.random.default_rng(1),
            settings=settings,
            payload=BLOCK,
            parameters=parameters,
            clock=clock,
            **options,
        )
        table = open_table(
            host,
            clock=clock,
            idle=emulator.service,
            rotation=options["specimen"] is not None,
            **(open_options or {}),
        )
        run = ReleasedRun(capacity.machine, settings.pulse, wait=0.2, coast=coast, rest=0.3)
        return Rig(table, emulator, clock, tap, run)

    yield make
    for bus in buses:
        bus.close()


both = pytest.mark.parametrize("name", sorted(MACHINES))


@both
def test_a_whole_run_is_the_planned_one(make_rig, name: str) -> None:
    rig = make_rig(name)
    rig.table.enable(0.0)
    assert rig.emulator.release_device.armed
    rig.heard()
    samples = rig.perform(rig.run.duration)
    t = np.array([sample.time for sample in samples])
    error = np.array([sample.position for sample in samples]) - rig.run.displacement(t)
    # Positions go in nanometres.
    assert np.abs(error).max() < 1e-9
    # The readings are means over the cycle before: they add up to the speed.
    speed = np.cumsum([sample.acceleration for sample in samples]) * H
    assert np.abs(speed - rig.run.velocity(t)).max() < 1e-6
    # Released in the cycle in which the pulse begins, not before, and then left so.
    fired = [bool(data & Output.RELEASE) for data in rig.outputs()]
    assert fired == [sample.cycle >= 200 for sample in samples]
    rig.table.disable()
    assert not rig.table.powered
    assert rig.emulator.plant.at_rest
    assert not rig.emulator.release_device.armed


@both
def test_a_late_latch_shows_as_the_difference_to_the_plan(make_rig, name: str) -> None:
    rig = make_rig(name, parameters=EXACT.model_copy(update={"release_delay": 4e-3}))
    rig.table.enable(0.0)
    samples = rig.perform(0.4)
    late = [sample.position - rig.run.displacement(sample.time - 4e-3) for sample in samples]
    assert max(map(abs, late)) < 1e-9


@both
def test_arming_moves_nothing_and_disarming_leaves_it_held(make_rig, name: str) -> None:
    rig = make_rig(name)
    rig.table.enable(0.0)
    assert all(sample.position == 0.0 for sample in rig.perform(0.19))
    rig.heard()
    way: list[Sample] = []
    rig.table.quick_stop(way.append)
    assert len(way) <= 3
    assert not any(data & Output.RELEASE for data in rig.outputs())
    assert rig.emulator.plant.held
    assert not rig.table.powered
    # And again.
    rig.table.enable(0.0)
    rig.perform(0.3)
    assert rig.emulator.plant.position > 1e-3


def test_a_stop_of_the_air_track_cuts_the_air_and_waits_for_rest(make_rig) -> None:
    rig = make_rig("air_track")
    rig.table.enable(0.0)
    rig.perform(0.5)
    x, v = rig.emulator.plant.position, rig.emulator.plant.velocity
    way: list[Sample] = []
    rig.table.quick_stop(way.append)
    # v^2 / (2 f), with one cycle on air before the stop takes effect; f = 1.5 m/s2.
    assert rig.table.position - x == pytest.approx(v * v / 3.0 + v * H, abs=2e-4)
    assert rig.emulator.plant.at_rest
    assert not rig.emulator.plant.air
    assert [sample.cycle for sample in way] == list(range(500, 500 + len(way)))
    assert len(way) * H == pytest.approx(v / 1.5 + 0.1, abs=0.03)


def test_nothing_stops_roori1_and_its_standstill_is_waited_for(make_rig) -> None:
    rig = make_rig("roori1")
    rig.table.enable(0.0)
    rig.perform(0.23)
    way: list[Sample] = []
    rig.table.quick_stop(way.append)
    planned = rig.run.displacement(np.array([sample.time for sample in way]))
    assert np.abs(np.array([sample.position for sample in way]) - planned).max() < 1e-9
    assert rig.table.position == pytest.approx(rig.run.net_displacement, abs=1e-9)
    assert not rig.table.powered


def test_a_standstill_that_is_not_confirmed_is_said_loudly(make_rig) -> None:
    rig = make_rig("air_track", open_options={"state_limit": 0.2})
    rig.table.enable(0.0)
    rig.perform(0.5)
    # The air supply cannot be cut: the relay is stuck.
    rig.emulator.release_device._obey = lambda: None
    with pytest.raises(DeviceTimeout, match=r"air_track did not confirm .* 0.2 s .*IT MAY STILL BE ARMED OR MOVING"):
        rig.table.quick_stop()
    assert rig.table.powered
    with pytest.raises(DeviceTimeout):
        rig.table.close()


@both
def test_a_silent_position_sensor_confirms_no_standstill_after_a_release(make_rig, name: str) -> None:
    rig = make_rig(name, open_options={"state_limit": 3.0})
    rig.table.enable(0.0)
    rig.perform(0.22)
    rig.emulator.devices[1].node.send = lambda *_: None
    with pytest.raises(DeviceTimeout, match="no position encoder came"):
        rig.perform(0.23, first=220)
    with pytest.raises(DeviceTimeout, match="did not confirm a standstill"):
        rig.table.quick_stop()
    # With the sensor back the next try succeeds.
    rig.emulator.devices[1].node.send = rig.emulator.send
    rig.table.quick_stop()
    assert not rig.table.powered


@both
def test_every_node_is_needed_in_the_cycle(make_rig, name: str) -> None:
    for k, what in enumerate(("inputs", "position encoder", "acceleration input", "rotation sensor")):
        rig = make_rig(name)
        rig.table.enable(0.0)
        rig.perform(0.01)
        rig.emulator.devices[k].node.send = lambda *_: None
        with pytest.raises(DeviceTimeout, match=f"no {what} came within 0.02 s"):
            rig.perform(0.02, first=10)


@both
def test_a_base_that_is_not_in_its_latch_is_not_armed(make_rig, name: str) -> None:
    rig = make_rig(name)
    rig.table.enable(0.0)
    rig.perform(rig.run.duration)
    rig.table.disable()
    with pytest.raises(
        SetpointRefused, match=r"is to be armed at 0.000000 m; its base stands at 0\.\d+ m and is not held"
    ):
        rig.table.enable(0.0)
    # Nor driven there: this machine follows no set-point.
    rig.heard()
    with pytest.raises(DeviceNotReady, match=rf"{name} stands \d+.\d mm from where it is held: put it back by hand"):
        bring_to(rig.table, 0.0, 1.0, rig.clock)
    assert not any(data for data in rig.outputs())
    rig.table.close()
    assert not rig.emulator.release_device.armed


@both
def test_the_next_host_finds_the_base_put_back(make_rig, name: str) -> None:
    rig = make_rig(name)
    first = None
    for _ in range(2):
        rig.table.enable(0.0)
        positions = [sample.position for sample in rig.perform(rig.run.duration)]
        first = first or positions
        assert positions == first
        rig.table.disable()
        rig.table.close()
        rig.table.open()


@both
def test_a_jammed_latch_is_found_out(make_rig, name: str) -> None:
    rig = make_rig(name)
    rig.table.enable(0.0)
    rig.emulator.plant.release = lambda: None
    with pytest.raises(DriveStopped, match=r"is still in its latch 0.25 s after its release"):
        rig.perform(rig.run.duration)
    rig.table.quick_stop()
    assert rig.emulator.plant.held


@both
def test_a_base_that_runs_away_before_its_release_is_found_out(make_rig, name: str) -> None:
    rig = make_rig(name)
    rig.table.enable(0.0)
    rig.perform(0.05)
    rig.emulator.plant.release()
    with pytest.raises(DriveStopped, match="left its latch before its release"):
        rig.perform(0.1, first=50)


@both
def test_a_release_device_that_disarms_itself_is_found_out(make_rig, name: str) -> None:
    rig = make_rig(name)
    rig.table.enable(0.0)
    rig.perform(0.05)
    rig.tap.send(frames.NMT, frames.pack_nmt(NmtCommand.RESET_NODE, 1))
    with pytest.raises((BusDisturbed, DriveStopped, DeviceTimeout)):
        rig.perform(0.3, first=50)
    rig.table.quick_stop()
    assert rig.emulator.plant.held


@both
def test_an_emergency_of_a_sensor_ends_the_run(make_rig, name: str) -> None:
    rig = make_rig(name)
    rig.table.enable(0.0)
    rig.perform(0.05)
    rig.emulator.devices[2].node.emergency(0x5000, 0x01)
    with pytest.raises(DriveStopped, match=f"node 3 of {name} reports error 5000"):
        rig.perform(0.1, first=50)
    rig.table.quick_stop()
    rig.table.reset_fault()
    rig.table.enable(0.0)


@both
def test_a_silent_node_is_missed_by_its_heartbeat(make_rig, name: str) -> None:
    rig = make_rig(name)
    rig.table.enable(0.0)
    sensor = rig.emulator.devices[2].node
    speak = sensor.send
    sensor.send = lambda identifier, data: None if identifier >= 0x700 else speak(identifier, data)
    rig.run = Motion.standstill(2.0)
    with pytest.raises(DeviceTimeout, match=f"node 3 of {name} has sent no heartbeat for 0.5 s"):
        rig.perform(2.0)


@both
def test_who_is_there(make_rig, name: str) -> None:
    rig = make_rig(name, inclinometer=True, initial_rotation=0.02, open_options={"inclinometer": True})
    described = rig.table.describe()
    assert [one.what for one in described] == [
        "release device",
        "position encoder",
        "acceleration input",
        "rotation sensor",
        "inclinometer",
    ]
    assert [one.node for one in described] == [1, 2, 3, 4, 5]
    assert described[0].state == "held"
    # To a thousandth of a degree.
    assert described[-1].state == "block tilted by +1.146 deg"
    assert rig.table.tilt_at_rest() == pytest.approx(0.02, abs=2e-5)
    rig.table.enable(0.0)
    with pytest.raises(DeviceNotReady, match="is to be described before it is stopped"):
        rig.table.describe()
    with pytest.raises(DeviceNotReady, match=r"the tilt .* is asked for before it is stopped"):
        rig.table.tilt_at_rest()
    with pytest.raises(DeviceNotReady, match=r"a fault .* is to be reset before it is stopped"):
        rig.table.reset_fault()
    assert math.isnan(make_rig(name).table.tilt_at_rest())


@both
def test_the_rotation_from_two_displacements(make_rig, name: str) -> None:
    rotations = iter(np.linspace(0.0, 0.3, 400).tolist())
    rig = make_rig(
        name,
        specimen=lambda *_: next(rotations),
        beams=(0.06, 0.27, 0.05, 0.2),
        open_options={"beams": 0.15},
    )
    rig.table.enable(0.0)
    for cycle in range(150):
        (sample,) = rig.perform((cycle + 1) * H, first=cycle)
        assert sample.rotation == pytest.approx(rig.emulator.plant.rotation, abs=1e-8)
    assert rig.emulator.plant.rotation > 0.05


@both
def test_without_a_specimen_there_is_no_rotation(make_rig, name: str) -> None:
    rig = make_rig(name, specimen=None)
    rig.table.enable(0.0)
    assert all(math.isnan(sample.rotation) for sample in rig.perform(0.05))


@both
def test_missed_cycles_are_left_out(make_rig, name: str) -> None:
    rig = make_rig(name)
    rig.table.enable(0.0)
    rig.perform(0.25)
    rig.clock.advance(10 * H)
    sample = rig.table.exchange(260, rig.run.displacement(261 * H))
    assert sample.position == pytest.approx(rig.run.displacement(0.26), abs=1e-9)
    with pytest.raises(DriveStopped, match=r"cycle 501 of .* comes 241 cycles after the last"):
        rig.table.exchange(501, 0.0)


@both
def test_the_wrong_device_is_refused(make_rig, name: str) -> None:
    rig = make_rig(name)
    rig.table.close()
    rig.emulator.devices[0].node.objects.set(0x1018, 99, 2)
    with pytest.raises(DeviceMismatch, match=f"node 1 of {name} is product 00000063"):
        rig.table.open()


def test_nobody_answers() -> None:
    with open_bus("virtual", "nobody") as bus, pytest.raises(DeviceTimeout, match="air_track does not answer"):
        open_air_track(bus, clock=ManualClock(), idle=lambda: None)


@both
def test_a_capacity_of_another_machine_is_refused(name: str) -> None:
    emulator = MACHINES[name][2]
    with open_bus("virtual", "other") as bus, pytest.raises(TypeError, match="capacity of quanser_st3 describes no"):
        emulator(bus, rng=np.random.default_rng(1), capacity=ST3)


class Sleepless:
    """A bus on which nothing comes, and every look takes one millisecond of the manual clock."""

    def __init__(self, clock: ManualClock) -> None:
        self.clock, self.left = clock, 20_000
        self.frames: list[tuple[int, bytes]] = []

    def send(self, identifier: int, data: bytes) -> None:
        self.frames.append((identifier, data))

    def receive(self, time_limit: float = 0.0) -> None:
        self.clock.advance(time_limit)
        self.left -= 1

    def is_set(self) -> bool:
        return self.left <= 0


@both
@pytest.mark.parametrize("released", [False, True])
def test_alone_in_its_process_it_disarms_itself_and_comes_to_rest(name: str, released: bool) -> None:
    capacity, _, emulator_of, pulse, coast = MACHINES[name]
    clock = ManualClock()
    bus = Sleepless(clock)
    settings = capacity.machine.settings_for(pulse, capacity, payload=BLOCK, coast=coast)
    emulator = emulator_of(bus, rng=np.random.default_rng(1), settings=settings, payload=BLOCK, clock=clock)
    emulator.boot()
    device = emulator.release_device
    device.receive(frames.NMT, frames.pack_nmt(NmtCommand.START, 1))
    for counter, outputs in enumerate((Output.ARM | Output.AIR, Output.ARM | Output.AIR | Output.RELEASE), start=1):
        if outputs & Output.RELEASE and not released:
            break
        emulator._take(0x201, bytes([outputs]))
        emulator._take(frames.SYNC, frames.pack_sync(counter))
    emulator.serve(bus)
    assert not device.armed
    assert emulator.at_ease
    assert (Input.HELD in device.inputs) is not released
    codes = [frames.unpack_emergency(data).code for identifier, data in bus.frames if identifier == 0x081]
    assert codes == [0x8700]
