"""Random scenes near the amplitude that first fells the block: every kind of excitation a table can perform.

A drawn scene is performed as asked: one whose pulse the table would clip is drawn again.
"""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from devices.catalogue import find_device
from excitation import Capacity, Pulse, Record
from twin.errors import InputError
from twin.rehearsal import clip_scene, make_motion, settings_for
from twin.rocking.block import Block
from twin.rocking.run import parameters
from twin.scene import Scene, parse_scene
from twin.scene_parts import TwinPart
from twin.simulation import overturns

KINDS = ("sine", "cosine", "constant", "double pulse, servo table", "double pulse, ROORI1", "record")
NEAR = (0.75, 1.35)
"""Amplitudes, over the one that first fells the block the twin knows."""
LARGEST = 12.0
"""Such amplitudes are looked for from that at which a block begins to lift up to so many times it."""
DRAWS = 200
SETTLE = 0.1
BLOCK = Block(0.06, 0.27)
P, LIMIT = BLOCK.frequency_parameter, BLOCK.uplift_acceleration
SLOW = 0.08
"""Of a double pulse, m/s: just above the least of ROORI1."""

SCENE = """
title = "{kind}"
[block]
width_mm = 60
height_mm = 270
mass_kg = 2.5692
[excitation]
{excitation}
[table]
device = "{device}"
settle_s = {settle}
seed = {seed}
[table.specimen]
restitution_change_percent = -5
slenderness_change_percent = 1
tilt_at_pulse_deg = {tilt}
rotation_noise_rad = 1e-3
[twin]
restitution_spread = {restitution}
slenderness_spread_percent = {slenderness}
initial_tilt_spread_deg = {lean}
"""


@dataclass(frozen=True)
class Drawn:
    """A scene, and how many were drawn before one could be performed as asked."""

    kind: str
    scene: Scene
    draws: int


@dataclass
class _Wish:
    """An excitation by its keys; `size` is the one that scales with its amplitude."""

    keys: dict[str, float | str]
    size: str
    at_first: float
    device: str = "quanser_st3"

    def text(self, factor: float) -> str:
        """Return the keys as TOML."""
        values = {**self.keys, self.size: self.at_first * factor}
        return "\n".join(f"{key} = {json.dumps(value)}" for key, value in values.items())


def draw(kind: str, seed: int, number: int, folder: Path, record: Record | None = None, spreads: float = 1.0) -> Drawn:
    """Return run `number`'s scene; equal arguments give equal scenes.

    Parameters
    ----------
    kind : str
        One of `KINDS`.
    seed, number : int
    folder : Path
        Where a record is written, as CSV.
    record : Record, optional
        A measured one: every second record is a window of it.
    spreads : float
        Factor on the spreads the twin states, a scene's defaults; the scenes are the same.
    """
    rng = np.random.default_rng([seed, number])
    tilt = math.copysign(0.2, rng.random() - 0.5)
    for n in range(1, DRAWS + 1):
        wish = _wish(kind, rng, folder / f"record_{number}.csv", record)
        factor = _first_fall(wish, folder)
        if factor is None:
            continue
        excitation = wish.text(factor * rng.uniform(*NEAR))
        text = _text(wish, excitation, kind=kind, seed=1000 * seed + number, tilt=tilt, spreads=spreads)
        scene = parse_scene(text, name=f"{kind.replace(', ', '_').replace(' ', '_')}_{number}", folder=folder)
        if _performed_as_asked(scene):
            return Drawn(kind, scene, n)
    raise RuntimeError(f"no {kind} that the table performs as asked in {DRAWS} draws")


def _wish(kind: str, rng: np.random.Generator, path: Path, record: Record | None) -> _Wish:
    if kind in ("sine", "cosine"):
        hertz = float(P * rng.uniform(0.8, 3.0) / math.tau)
        cycles = float(rng.choice([1, 1, 2, 4])) if kind == "sine" else 1.0
        return _Wish({"kind": kind, "frequency_hz": hertz, "cycles": cycles}, "amplitude_m_s2", LIMIT)
    if kind == "constant":
        return _Wish({"kind": kind, "duration_s": float(rng.uniform(0.05, 0.25))}, "acceleration_m_s2", LIMIT)
    if kind == "double pulse, ROORI1":
        gap = float(rng.uniform(12.0, 35.0))
        return _Wish({"kind": "double_pulse", "stop_gap_mm": gap}, "peak_velocity_m_s", SLOW, "roori1")
    if kind == "double pulse, servo table":
        keys: dict[str, float | str] = {"kind": "double_pulse", "stop_gap_mm": float(rng.uniform(12.0, 60.0))}
        keys["pulse_acceleration_m_s2"] = float(rng.uniform(4.0, 9.5))
        return _Wish(keys, "peak_velocity_m_s", SLOW)
    samples, step = _window(rng, record) if record is not None and rng.random() < 0.5 else synthetic(rng)
    _write(path, samples, step)
    return _Wish({"kind": "record", "path": path.name}, "scale", LIMIT)


def synthetic(rng: np.random.Generator) -> tuple[np.ndarray, float]:
    """Return 5 s of ground motion, peak 1 m/s2, and its step, s: waves of random phase through a ground filter.

    The spectrum is Kanai's (1957) and Tajimi's (1960) from 0.8 to 6 Hz, and the envelope is on the displacement, so
    that the base ends where it began.
    """
    step, n = 0.01, 501
    t = np.arange(n) * step
    ground, damping = rng.uniform(1.2, 2.8), rng.uniform(0.2, 0.5)
    f = np.arange(0.8, 6.0, 0.1) + rng.uniform(0.0, 0.1, 52)
    r2 = (f / ground) ** 2
    size = np.sqrt((1.0 + 4.0 * damping**2 * r2) / ((1.0 - r2) ** 2 + 4.0 * damping**2 * r2))
    phases = rng.uniform(0.0, math.tau, f.size)
    waves = np.sin(math.tau * np.outer(t, f) + phases) @ (size / f**2)
    ramp = np.clip(np.minimum(t / 1.5, (t[-1] - t) / 1.5), 0.0, 1.0)
    envelope = ramp**3 * (10.0 + ramp * (6.0 * ramp - 15.0))
    a = np.gradient(np.gradient(waves * envelope, step), step)
    return a / np.max(np.abs(a)), step


def _window(rng: np.random.Generator, record: Record) -> tuple[np.ndarray, float]:
    """Return 6 s of a measured record, from 0.7 Hz up, as a table with a short stroke plays it; peak 1 m/s2."""
    step, n = record.time_step, round(6.0 / record.time_step)
    spectrum = np.fft.rfft(record.samples)
    f = np.fft.rfftfreq(record.samples.size, step)
    whole = np.fft.irfft(spectrum * np.clip((f - 0.5) / 0.4, 0.0, 1.0), record.samples.size)
    strongest = int(np.argmax(np.abs(whole)))
    start = int(np.clip(strongest - rng.uniform(0.15, 0.85) * n, 0, whole.size - n))
    a = whole[start : start + n] * np.hanning(n) ** 0.25
    a -= np.mean(a) * np.hanning(n) / np.mean(np.hanning(n))
    return a / np.max(np.abs(a)), step


def _write(path: Path, samples: np.ndarray, step: float) -> None:
    rows = [f"{k * step:.4f},{value:.9f}" for k, value in enumerate(samples.tolist())]
    path.write_text("\n".join(["time_s,acceleration_m_s2", *rows]) + "\n", encoding="utf-8")


def _scene(wish: _Wish, factor: float, folder: Path) -> Scene:
    return parse_scene(_text(wish, wish.text(factor)), name="search", folder=folder)


def _text(
    wish: _Wish, excitation: str, *, kind: str = "", seed: int = 0, tilt: float = 0.0, spreads: float = 1.0
) -> str:
    stated = TwinPart()
    return SCENE.format(
        kind=kind,
        excitation=excitation,
        device=wish.device,
        settle=SETTLE,
        seed=seed,
        tilt=tilt,
        restitution=spreads * stated.restitution_spread,
        slenderness=spreads * stated.slenderness_spread_percent,
        lean=spreads * stated.initial_tilt_spread_deg,
    )


def _first_fall(wish: _Wish, folder: Path) -> float | None:
    """Return the least factor, in steps of 2 %, that overturns the twin's block; None where none does."""
    scene = _scene(wish, 1.0, folder)
    capacity = find_device(wish.device).capacity
    body = parameters(BLOCK, BLOCK.housner_restitution)
    pulse = scene.pulse()
    assert pulse is not None
    factor = 1.0
    while factor < LARGEST:
        try:
            if overturns(body, _shaking(scene, capacity, pulse.scaled(factor)).pieces):
                return factor
        except ValueError:
            return None
        factor *= 1.02
    return None


def _shaking(scene: Scene, capacity: Capacity, pulse: Pulse) -> Pulse:
    """Return what shakes the block, whatever the capacity: a servo table's is the pulse with its brake."""
    if capacity.machine is None:
        return make_motion(scene, None, pulse).shaking
    settings = settings_for(scene, capacity, pulse)
    return make_motion(scene, capacity, pulse if settings is None else settings.pulse).shaking


def _performed_as_asked(scene: Scene) -> bool:
    capacity = find_device(scene.table.device).capacity
    try:
        pulse = scene.pulse()
        assert pulse is not None
        clipped = clip_scene(scene, capacity, pulse)
        if clipped.given is None or clipped.limits:
            return False
        settings_for(scene, capacity, clipped.given)
        make_motion(scene, capacity, clipped.given)
    except (InputError, ValueError):
        return False
    return True
