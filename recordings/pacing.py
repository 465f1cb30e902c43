"""When the next sample of a replay is due: as fast as it goes, at a speed, or as somebody at the keys says."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from collections.abc import Callable

    from devices.clock import Clock

SLOWEST, FASTEST = 0.1, 100.0
"""Bounds of the speed; 1 is real time."""
LOOK_INTERVAL = 0.02
"""Time between two looks at the keys, s."""
PAUSE, STEP, FASTER, SLOWER, QUIT = "space", "step", "faster", "slower", "quit"
"""What a key can mean."""


class Pace(Protocol):
    """Holds a replay back. Contract: times rise; once `wait` has said False it is not asked again."""

    def wait(self, time: float) -> bool:
        """Return True when the sample of `time` (recorded clock, s) is due, False where the replay shall end."""
        ...


class Unpaced:
    """As fast as it goes."""

    def wait(self, time: float) -> bool:  # noqa: ARG002 - the same call for every pace
        """Return True at once."""
        return True


class SteadyPace:
    """At `speed` times real time from the first sample on; one that is late is not waited for."""

    def __init__(self, clock: Clock, speed: float) -> None:
        self._clock = clock
        self._speed = speed
        self._begin: tuple[float, float] | None = None

    def wait(self, time: float) -> bool:
        """Return True when the sample of `time` is due."""
        if self._begin is None:
            self._begin = self._clock.now(), time
        now, first = self._begin
        self._clock.wait_until(now + (time - first) / self._speed)
        return True


class SteeredPace:
    """At a speed that keys change: pause, one sample at a time, faster, slower, quit.

    Parameters
    ----------
    clock : Clock
    speed : float
        To begin with.
    key : callable
        Waits at most so many seconds for a key, and returns what it means (`PAUSE`, ...), or None.
    paused : bool
        Whether it begins with a pause.
    """

    def __init__(self, clock: Clock, speed: float, key: Callable[[float], str | None], *, paused: bool = False) -> None:
        self.speed = speed
        self.paused = paused
        self._clock = clock
        self._key = key
        self._anchor: tuple[float, float] | None = None
        self._looked = clock.now()

    def wait(self, time: float) -> bool:
        """Return True when the sample of `time` is due, or was stepped to; False after a quit."""
        if self._anchor is None:
            self._anchor = self._clock.now(), time
        while True:
            now, first = self._anchor
            ahead = now + (time - first) / self.speed - self._clock.now()
            if not self.paused and ahead <= 0.0 and self._clock.now() - self._looked < LOOK_INTERVAL:
                return True
            self._looked = self._clock.now()
            meaning = self._key(LOOK_INTERVAL if self.paused else min(max(ahead, 0.0), LOOK_INTERVAL))
            if meaning == QUIT:
                return False
            if meaning is not None and self._obey(meaning, time):
                return True

    def _obey(self, meaning: str, time: float) -> bool:
        """Change the pace from the sample of `time` on; return whether it is due by that."""
        stepped = meaning == STEP
        if meaning == PAUSE:
            self.paused = not self.paused
        elif stepped:
            self.paused = True
        else:
            self.speed = min(max(self.speed * (2.0 if meaning == FASTER else 0.5), SLOWEST), FASTEST)
        self._anchor = self._clock.now(), time
        return stepped
