"""Stand-ins for `quanser.hardware`: one that checks the exact calls, one with a motor that really moves."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np

from devices.clock import ManualClock
from devices.quanser_st3.parameters import St3Parameters


class HILError(Exception):
    """Quanser's errors look their text up."""

    def get_error_message(self) -> str:
        return f"It is not possible: {self.args[0]}."


def module(board: Any) -> Any:
    """Return what `import quanser.hardware` would, with `board` as the only board."""

    class HIL:
        INFINITE = -1

        def __new__(cls) -> Any:
            return board

        @staticmethod
        def get_version() -> Any:
            return SimpleNamespace(major=4, minor=1, release=3234, build=5)

    return SimpleNamespace(
        HIL=HIL, HILError=HILError, Clock=SimpleNamespace(HARDWARE_CLOCK_0=0), DigitalState=SimpleNamespace(TRISTATE=2)
    )


def _plain(value: Any) -> Any:
    return (str(value.dtype), value.tolist()) if isinstance(value, np.ndarray) else value


class ExpectedCalls:
    """Takes exactly these calls in this order; each is (name, arguments, result), a result may fill the buffers."""

    def __init__(self, calls: list[tuple[str, tuple[Any, ...], Any]]) -> None:
        self.left = deque(calls)

    def __getattr__(self, name: str) -> Callable[..., Any]:
        def call(*arguments: Any) -> Any:
            assert self.left, f"{name}{arguments} was not expected: nothing was"
            expected, wanted, result = self.left.popleft()
            got = tuple(map(_plain, arguments))
            assert (name, got) == (expected, wanted)
            return result(*arguments) if callable(result) else result

        return call


class MovingBoard:
    """A board with a motor, a table and its sensors on it, in the time of a manual clock.

    The clock moves where the board is waited for; where the host stalls (`clock.advance`), the table goes on with the
    last output, and samples pile up. The board's own clock may be off by `drift`.
    """

    def __init__(self, clock: ManualClock, *, friction: float = 3.0, drift: float = 0.0, payload: float = 0.0) -> None:
        p = St3Parameters()
        self.clock, self.drift = clock, drift
        self.push = p.force_per_ampere * 2.0 / (p.moving_mass + payload)  # 2 A/V
        self.friction = friction
        self.encoder_step = p.encoder_step
        self.position = self.velocity = self.acceleration = 0.0
        self.output = self.largest = 0.0
        self.rotation_count = 0
        self.opened = self.closed = False
        self.expired = False
        self.calls: list[str] = []
        self.fail_at: dict[int, BaseException] = {}
        self.fail_always: set[str] = set()
        self.blocked: Callable[[], int] | None = None
        self.frozen = False
        self._time = clock.now()
        self._timeout: float | None = None
        self._reloaded = 0.0
        self._zero_on_expiry = False
        self._rate: float | None = None
        self._samples: deque[int] = deque()
        self._next = 0.0

    @property
    def running(self) -> bool:
        return self._rate is not None

    def _count(self) -> int:
        return 0 if self.frozen else round(self.position / self.encoder_step)

    def live(self, until: float) -> None:
        """Move on to `until`, s, stopping at samples and at the watchdog's end."""
        while self._time < until:
            stops = [until, self._time + 2e-4]
            if self._rate is not None:
                stops.append(self._next)
            if self._timeout is not None and not self.expired:
                stops.append(self._reloaded + self._timeout)
            to = min(s for s in stops if s > self._time)
            self._move(to - self._time)
            self._time = to
            if self._timeout is not None and not self.expired and to >= self._reloaded + self._timeout:
                self.expired = True
                self.output = 0.0 if self._zero_on_expiry else self.output
            if self._rate is not None and to >= self._next:
                self._samples.append(self._count())
                self._next += (1.0 + self.drift) / self._rate

    def _move(self, h: float) -> None:
        drive = self.push * self.output
        if self.velocity == 0.0:
            drag = math.copysign(min(abs(drive), self.friction), drive)
        else:
            drag = math.copysign(self.friction, self.velocity)
        self.acceleration = drive - drag
        after = self.velocity + h * self.acceleration
        if self.velocity * after < 0.0:
            after = 0.0
        self.position += 0.5 * h * (self.velocity + after)
        self.velocity = after

    def _called(self, name: str) -> None:
        self.live(self.clock.now())
        number = len(self.calls)
        self.calls.append(name)
        if number in self.fail_at:
            raise self.fail_at[number]
        if name in self.fail_always:
            raise HILError(name)

    def open(self, board: str, identifier: str) -> None:
        self._called("open")
        assert (board, identifier) == ("q8_usb", "0")
        self.opened = True

    def close(self) -> None:
        self._called("close")
        self.closed, self._rate = True, None

    def write_analog(self, channels: Any, count: int, volts: Any) -> None:
        self._called("write_analog")
        assert (channels.tolist(), count) == ([0], 1)
        if not self.expired or volts[0] == 0.0:
            self.output = float(volts[0])
            self.largest = max(self.largest, abs(self.output))

    def read_encoder(self, channels: Any, count: int, buffer: Any) -> None:
        self._called("read_encoder")
        assert (channels.tolist(), count) == ([0, 1], 2)
        buffer[:] = self._count(), self.rotation_count

    def read_analog(self, channels: Any, count: int, buffer: Any) -> None:
        self._called("read_analog")
        assert (channels.tolist(), count) == ([0], 1)
        buffer[0] = self.acceleration / 9.81

    def task_create_reader(self, samples: int, *channels: Any) -> str:
        self._called("task_create_reader")
        assert samples == 100
        return "task"

    def task_start(self, task: str, clock: int, rate: float, samples: int) -> None:
        self._called("task_start")
        assert (task, clock, samples) == ("task", 0, -1)
        self._rate, self._next = rate, self._time + 1.0 / rate
        self._samples.clear()

    def task_read(self, task: str, samples: int, volts: Any, counts: Any, digital: None, other: None) -> int:
        self._called("task_read")
        assert (task, samples) == ("task", 1)
        if self.blocked is not None:
            return self.blocked()
        if not self._samples:
            wait = self._next - self._time
            self.clock.advance(wait + 1e-9)
            self.live(self.clock.now())
        counts[:] = self._samples.popleft(), self.rotation_count
        volts[0] = self.acceleration / 9.81
        return 1

    def task_stop(self, task: str) -> None:
        self._called("task_stop")
        self._rate = None

    def task_delete(self, task: str) -> None:
        self._called("task_delete")

    def watchdog_set_analog_expiration_state(self, channels: Any, count: int, volts: Any) -> None:
        self._called("watchdog_set_analog_expiration_state")
        assert (channels.tolist(), count, volts.tolist()) == ([0], 1, [0.0])
        self._zero_on_expiry = True

    def watchdog_start(self, timeout: float) -> None:
        self._called("watchdog_start")
        self._timeout, self._reloaded = timeout, self._time

    def watchdog_reload(self) -> bool:
        self._called("watchdog_reload")
        self._reloaded = self._time
        return not self.expired

    def watchdog_stop(self) -> None:
        self._called("watchdog_stop")
        self._timeout = None

    def watchdog_is_expired(self) -> bool:
        self._called("watchdog_is_expired")
        return self.expired

    def watchdog_clear(self) -> None:
        self._called("watchdog_clear")
        self.expired = False
