"""Tables that are not there, none of them the project's emulator: what the iteration must not know."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from scipy.signal import cont2discrete, lfilter, ss2tf

from devices.setpoints import first_refusal
from excitation import Capacity, Motion, Pulse, SineWave
from twin.tuning.window import Trace, Window, window_of

H = 1e-3
SINE = SineWave(2.943, 4.0)
BENCH = Capacity(name="bench", stroke=0.2, velocity=0.6, acceleration=9.81)


@dataclass
class Setting:
    """A pulse in its run: what an iteration is started with."""

    motion: Motion
    window: Window
    command: np.ndarray

    @classmethod
    def of(cls, pulse: Pulse, pause: float = 1.0) -> Setting:
        motion = Motion(pulse, 1.09, brake=1.09, settle=1.0)
        times = np.arange(math.ceil(motion.duration / H) + 2) * H
        return cls(motion, window_of(motion, H, pause), motion.displacement(times))


@dataclass
class Table:
    """Second-order closed loop with a delay, seen through an encoder and an accelerometer.

    `truth` holds the true acceleration of every run, `played` every command.
    """

    frequency: float = 31.9
    damping: float = 0.78
    delay: int = 1
    gain: Callable[[], float] = lambda: 1.0
    noise: float = 0.049
    bias: float = 0.02
    encoder: float = 1.55e-6
    seed: int = 1
    truth: list[np.ndarray] = field(default_factory=list)
    played: list[np.ndarray] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.rng = np.random.default_rng(self.seed)

    def __call__(self, command: np.ndarray) -> Trace:
        start = command[0]
        reference = self.gain() * (np.concatenate([np.full(self.delay, start), command]) - start)
        position, acceleration = self.answer(reference[: command.size - 1])
        self.played.append(command.copy())
        self.truth.append(acceleration)
        position = position + start
        if self.encoder:
            position = np.round(position / self.encoder) * self.encoder
        return Trace(position, acceleration + self.bias + self.noise * self.rng.standard_normal(acceleration.size))

    def answer(self, reference: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Position and acceleration, the reference being linear between samples."""
        w, z = math.tau * self.frequency, self.damping
        system = (
            np.array([[0.0, 1.0], [-w * w, -2.0 * z * w]]),
            np.array([[0.0], [w * w]]),
            np.array([[1.0, 0.0], [-w * w, -2.0 * z * w]]),
            np.array([[0.0], [w * w]]),
        )
        numerators, denominator = ss2tf(*cont2discrete(system, H, method="foh")[:4])
        return tuple(lfilter(numerator, denominator, reference) for numerator in numerators)

    def response(self, frequency: np.ndarray) -> np.ndarray:
        """Closed form of acceleration over commanded acceleration."""
        s = 2j * math.pi * frequency
        w, z = math.tau * self.frequency, self.damping
        return w * w / (s * s + 2.0 * z * w * s + w * w) * np.exp(-s * self.delay * H)


@dataclass
class Weak(Table):
    """A table whose motor gives no more than `most`, m/s2."""

    most: float = 2.5

    def answer(self, reference: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        w, z = math.tau * self.frequency, self.damping
        x = v = 0.0
        positions, accelerations = [], []
        for r in reference.tolist():
            a = min(max(w * w * (r - x) - 2.0 * z * w * v, -self.most), self.most)
            v += a * H
            x += v * H
            positions.append(x)
            accelerations.append(a)
        return np.array(positions), np.array(accelerations)


def true_error(table: Table, window: Window) -> tuple[float, float]:
    """Root mean square and largest error of the last run, of the asked peak, without any sensor between."""
    error = (window.acceleration - window.cut(table.truth[-1]))[window.judged] / window.peak
    return float(np.sqrt(np.mean(error**2))), float(np.max(np.abs(error)))


def inside(capacity: Capacity) -> Callable[[np.ndarray], str | None]:
    """The rule of table and drive, for a whole command."""

    def refused(command: np.ndarray) -> str | None:
        refusal = first_refusal(capacity, H, 1e-9, command[0], command[1:].tolist())
        return None if refusal is None else refusal.sentence

    return refused
