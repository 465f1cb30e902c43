"""The emulated drive by its frames alone: what is injected below the host, and what it answers."""

from __future__ import annotations

import itertools

import pytest

from devices.cia301 import frames
from devices.cia301.frames import NmtCommand, NmtState
from devices.cia402 import states
from devices.cia402.drive import Drive, DriveOptions
from devices.cia402.frames import pack_target, unpack_actual
from devices.cia402.states import State, decode
from excitation import Capacity

H = 1e-3
CAPACITY = Capacity(name="bench", stroke=0.2, velocity=0.5, acceleration=10.0, provenance={})


class Stiff:
    """A machine that is where it is told to be."""

    def __init__(self) -> None:
        self.position = 0.0
        self.velocity = 0.0

    def advance(self, setpoint: float) -> None:
        self.velocity = (setpoint - self.position) / H
        self.position = setpoint

    def measure_position(self) -> float:
        return self.position

    def measure_acceleration(self) -> float:
        return 1.5


class Bench:
    """A booted drive, and what it sent."""

    def __init__(self, **options) -> None:
        self.sent: list[tuple[int, bytes]] = []
        self.machine = Stiff()
        self.drive = Drive(
            1,
            lambda identifier, data: self.sent.append((identifier, data)),
            self.machine,
            CAPACITY,
            H,
            options=DriveOptions(**options),
        )
        self.drive.boot()
        self.counter = 0

    def nmt(self, command: NmtCommand, node: int = 1) -> None:
        self.drive.receive(frames.NMT, frames.pack_nmt(command, node))

    def sync(self, steps: int = 1) -> list[tuple[int, bytes]]:
        self.sent.clear()
        self.counter += steps
        self.drive.receive(frames.SYNC, frames.pack_sync(frames.sync_counter(self.counter)))
        return list(self.sent)

    def cycle(self, target: float, controlword: int = states.ENABLE_OPERATION, steps: int = 1) -> State | None:
        self.drive.receive(0x201, pack_target(controlword, round(target / 1e-9)))
        answers = dict(self.sync(steps))
        return decode(unpack_actual(answers[0x181])[0])

    def enabled(self) -> Bench:
        self.nmt(NmtCommand.START)
        for controlword in (states.SHUTDOWN, states.SWITCH_ON, states.ENABLE_OPERATION):
            self.cycle(0.0, controlword)
        assert self.drive.state is State.OPERATION_ENABLED
        return self

    def moving(self, velocity: float = 0.3) -> Bench:
        """Enabled, and brought to `velocity` at 9 m/s2."""
        self.enabled()
        x = v = 0.0
        while v < velocity - 1e-9:
            v = min(velocity, v + 9.0 * H)
            x += v * H
            self.cycle(x)
        assert self.drive.state is State.OPERATION_ENABLED
        return self

    def emergencies(self) -> list[int]:
        return [frames.unpack_emergency(data).code for identifier, data in self.sent if identifier == 0x081]

    def run_down(self, limit: int = 2000) -> int:
        """SYNCs alone until nothing moves; return how many."""
        for n in range(limit):
            if self.drive.at_ease:
                return n
            self.sync()
        raise TimeoutError("the drive does not come to rest")


def test_boot_up_and_nothing_before_start() -> None:
    bench = Bench()
    assert bench.sent == [(0x701, b"\x00")]
    assert bench.drive.state is State.SWITCH_ON_DISABLED
    assert bench.sync() == []
    bench.nmt(NmtCommand.START, node=9)
    assert bench.sync() == []
    bench.nmt(NmtCommand.START, node=0)
    assert [identifier for identifier, _ in bench.sync()] == [0x181, 0x281]


def test_answer_carries_position_and_acceleration() -> None:
    bench = Bench().moving()
    answers = dict(bench.sync())
    assert unpack_actual(answers[0x181])[1] == round(bench.machine.position / 1e-9)
    assert frames.unpack_long(answers[0x281], "TPDO2") == 1_500_000


@pytest.mark.parametrize(
    ("command", "state"),
    [
        (NmtCommand.STOP, NmtState.STOPPED),
        (NmtCommand.ENTER_PRE_OPERATIONAL, NmtState.PRE_OPERATIONAL),
        (NmtCommand.RESET_NODE, NmtState.PRE_OPERATIONAL),
    ],
)
def test_leaving_operational_stops_the_table(command: NmtCommand, state: NmtState) -> None:
    bench = Bench().moving()
    bench.sent.clear()
    bench.nmt(command)
    assert bench.emergencies() == [0x8130]
    assert bench.drive.node.state is state
    bench.run_down()
    assert bench.machine.velocity == 0.0
    assert bench.drive.state is State.FAULT


def test_heartbeat_runs_on_its_own_time() -> None:
    bench = Bench()
    bench.sent.clear()
    for milliseconds in range(0, 1001, 10):
        bench.drive.node.beat(milliseconds / 1000)
    assert len(bench.sent) in (10, 11)
    assert set(bench.sent) == {(0x701, b"\x7f")}


def test_target_is_reached_one_cycle_later() -> None:
    bench = Bench().enabled()
    bench.cycle(1e-6)
    assert bench.machine.position == 0.0
    bench.cycle(3e-6)
    assert bench.machine.position == pytest.approx(1e-6, abs=1e-15)


@pytest.mark.parametrize("missed", [1, 2, 15])
def test_missed_syncs_do_not_slow_the_clock(missed: int) -> None:
    bench = Bench().moving()
    before, last = bench.drive.cycle, bench.machine.position + 0.3 * H
    for k in (1, 2):
        bench.cycle(last + 0.3 * k * H)
    bench.cycle(last + 0.3 * (missed + 3) * H, steps=missed + 1)
    assert bench.drive.cycle == before + missed + 3
    # it went on at 0.3 m/s all the while
    assert bench.machine.position == pytest.approx(last + 0.3 * (missed + 2) * H, abs=1e-6)
    assert bench.drive.state is State.OPERATION_ENABLED


def test_the_same_sync_twice_is_one() -> None:
    bench = Bench().moving()
    before = bench.drive.cycle
    bench.sync()
    assert bench.sync(steps=0) == []
    assert bench.drive.cycle == before + 1


@pytest.mark.parametrize(("steps", "code"), [(40, 0x8700), (1, 0x8250)])
def test_silence_of_sync_or_of_set_points_stops_the_table(steps: int, code: int) -> None:
    bench = Bench().moving()
    seen = []
    for _ in range(0, 40, steps):
        bench.sync(steps)
        seen += bench.emergencies()
    assert seen == [code]
    bench.run_down()
    assert bench.drive.state is State.FAULT
    assert abs(bench.machine.position) <= 0.1


def test_silence_told_by_the_drives_own_clock() -> None:
    bench = Bench().moving()
    bench.sent.clear()
    bench.drive.elapse(21)
    assert bench.emergencies() == []
    bench.drive.elapse(1)
    assert bench.emergencies() == [0x8700]
    bench.drive.elapse(500)
    assert bench.drive.at_ease
    bench.sync()
    assert bench.drive.state is State.FAULT


@pytest.mark.parametrize(
    ("asked", "code"),
    [
        (0.5 * H, None),  # at the limit of velocity, from just below it
        (0.500002 * H, 0x8400),
        (0.499 * H - 10.0 * H * H, None),  # at the limit of acceleration, braking
        (0.499 * H - 10.004 * H * H, 0x8500),
        (0.2, 0x8612),
    ],
)
def test_each_limit_refused_below_the_host(asked: float, code: int | None) -> None:
    bench = Bench().moving(0.499)
    x = bench.machine.position + 0.499 * H  # the last target, reached at the next SYNC
    bench.cycle(x + asked)
    assert bench.emergencies() == ([] if code is None else [code])
    assert (bench.drive.state is State.OPERATION_ENABLED) is (code is None)
    if code is not None:
        speeds = [bench.machine.velocity]
        assert bench.cycle(x) is State.FAULT_REACTION_ACTIVE
        while not bench.drive.at_ease:
            bench.sync()
            speeds.append(bench.machine.velocity)
        assert bench.drive.state is State.FAULT
        assert bench.machine.position <= 0.1
        # from x with 0.499 m/s: the stated 1 m/s2 would need 0.125 m, so just as much more as the room asks
        steepest = max(a - b for a, b in itertools.pairwise(speeds)) / H
        assert 0.499**2 / (2 * 0.1) <= steepest <= 10.0


def test_stroke_at_the_limit_and_a_count_beyond() -> None:
    for beyond, fine in ((0, True), (1, False)):
        bench = Bench(start_window=1.0).enabled()
        bench.drive.interpolator.begin(bench.drive.cycle, 0.1 - 4e-9)
        bench.cycle(0.1 + beyond * 1e-9)
        assert (bench.emergencies() == []) is fine


def test_refusal_raises_the_internal_limit_bit_until_reset() -> None:
    bench = Bench().enabled()
    bench.cycle(0.05)
    answers = dict(bench.sync())
    assert unpack_actual(answers[0x181])[0] & states.INTERNAL_LIMIT
    bench.run_down()
    assert bench.drive.state is State.FAULT
    bench.cycle(0.0, states.DISABLE_VOLTAGE)
    bench.cycle(0.0, states.FAULT_RESET)
    assert bench.emergencies() == [0x0000]
    assert bench.drive.state is State.SWITCH_ON_DISABLED
    answers = dict(bench.sync())
    assert not unpack_actual(answers[0x181])[0] & states.INTERNAL_LIMIT
    bench.enabled()


@pytest.mark.parametrize("controlword", [states.QUICK_STOP, states.DISABLE_VOLTAGE, states.SHUTDOWN, states.SWITCH_ON])
def test_every_way_out_of_operation_enabled_ramps_down(controlword: int) -> None:
    bench = Bench().moving()
    bench.cycle(0.0, controlword)
    assert bench.drive.state is not State.OPERATION_ENABLED
    last = bench.machine.velocity
    while not bench.drive.at_ease:
        bench.cycle(0.0, controlword)
        assert last - bench.machine.velocity <= 1.0 * H + 1e-9
        last = bench.machine.velocity
    assert bench.machine.velocity == 0.0
    assert bench.emergencies() == []
    if controlword == states.QUICK_STOP:
        assert bench.drive.state is State.SWITCH_ON_DISABLED


def test_no_way_up_while_it_moves() -> None:
    bench = Bench().moving()
    bench.cycle(0.0, states.DISABLE_VOLTAGE)
    for controlword in (states.SHUTDOWN, states.SWITCH_ON, states.ENABLE_OPERATION):
        bench.cycle(0.0, controlword)
    assert bench.drive.state is State.SWITCH_ON_DISABLED
    bench.run_down()


@pytest.mark.parametrize(("target", "code"), [(21e-6, 0x8611), (-19e-6, None), (0.2, 0x8612)])
def test_first_set_point_must_be_where_the_table_stands(target: float, code: int | None) -> None:
    bench = Bench()
    bench.nmt(NmtCommand.START)
    for controlword in (states.SHUTDOWN, states.SWITCH_ON, states.ENABLE_OPERATION):
        bench.cycle(target, controlword)
    assert bench.emergencies() == ([] if code is None else [code])


def test_malformed_frames_are_counted_and_do_nothing() -> None:
    bench = Bench().moving()
    state = bench.drive.state
    for identifier, data in ((0x201, b"\x0f\x00"), (0x080, b""), (0x080, b"\xff"), (0x000, b"\x01")):
        bench.drive.receive(identifier, data)
    bench.drive.receive(0x202, b"whatever")
    bench.nmt(0x77)  # type: ignore[arg-type]
    assert bench.drive.node.refused_frames == 4
    assert bench.drive.state is state


def test_node_number_is_checked() -> None:
    with pytest.raises(ValueError, match="1 to 127"):
        Drive(0, lambda *_: None, Stiff(), CAPACITY, H)
