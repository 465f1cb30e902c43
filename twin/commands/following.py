"""How a scene's table follows its command: its numbers, emulated or real, where the device tells them."""

from __future__ import annotations

from typing import Protocol, runtime_checkable

from devices.errors import UnknownDevice
from twin.commands.inputs import emulator_numbers
from twin.scene import Scene


class Loop(Protocol):
    @property
    def angular_frequency(self) -> float: ...

    @property
    def damping(self) -> float: ...

    @property
    def transport_delay(self) -> float: ...


@runtime_checkable
class Following(Protocol):
    """Numbers of a table that know how it follows its command with a payload, kg, on it."""

    def loop(self, payload: float = 0.0) -> Loop: ...


def following_of(scene: Scene) -> Following | None:
    """Return the numbers of the scene's table; None where it says nothing of its loop. Raises `InputError`."""
    try:
        numbers = emulator_numbers(scene)
    except UnknownDevice:
        return None
    return numbers if isinstance(numbers, Following) else None
