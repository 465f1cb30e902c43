"""How a scene's table moves, for the checks of the whole run: the numbers its emulator is made of."""

from __future__ import annotations

import math
from typing import Protocol, runtime_checkable

from excitation import Capacity
from twin.commands.following import following_of
from twin.commands.inputs import device_of
from twin.scene import Scene
from twin.whole_run.mechanics import TableMechanics


@runtime_checkable
class _Driven(Protocol):
    """Numbers of a table that also know its motor, its ends and its mass."""

    moving_mass: float
    top_speed: float
    switch_distance: float
    bumper_distance: float
    bumper_stiffness: float
    bumper_damping: float
    friction: float

    def largest_acceleration(self, payload: float = 0.0) -> float: ...

    def source(self, name: str) -> str: ...


def mechanics_of(scene: Scene, capacity: Capacity) -> TableMechanics:
    """Return how the scene's table moves with its block on it, emulated or real: as the device's numbers have it.

    A device that says nothing of its loop is taken to follow exactly.

    Raises
    ------
    InputError
        Where the numbers of the scene's capacity file make no sense.
    """
    numbers = following_of(scene)
    if numbers is None:
        return TableMechanics()
    payload = scene.block.mass_kg or 0.0
    loop = numbers.loop(payload)
    frequency = loop.angular_frequency / math.tau
    name = device_of(scene).name
    if not isinstance(numbers, _Driven):
        return TableMechanics(
            frequency=frequency, damping=loop.damping, delay=loop.transport_delay, source=f"{name}'s linear model"
        )
    half = 0.5 * capacity.stroke
    return TableMechanics(
        frequency=frequency,
        damping=loop.damping,
        delay=loop.transport_delay,
        strongest=numbers.largest_acceleration(payload),
        top_speed=numbers.top_speed,
        switch=half + numbers.switch_distance,
        bumper=half + numbers.bumper_distance,
        bumper_stiffness=numbers.bumper_stiffness,
        bumper_damping=numbers.bumper_damping,
        friction=numbers.friction,
        mass=numbers.moving_mass + payload,
        source=(
            f"{name}'s emulator: loop {numbers.source('loop_frequency')}; "
            f"moving mass {numbers.source('moving_mass')}; friction {numbers.source('friction')}"
        ),
    )
