"""The rotation sensor's node."""

from __future__ import annotations

import math

import numpy as np
import pytest

from devices.cia301 import frames
from devices.cia301.frames import NmtCommand
from devices.errors import FrameError
from devices.sensors.rotation import RotationSensor, decode_rotation


class Bench:
    def __init__(self, **options) -> None:
        self.sent: list[tuple[int, bytes]] = []
        self.rotation = 0.0
        self.sensor = RotationSensor(
            2, lambda identifier, data: self.sent.append((identifier, data)), lambda: self.rotation, **options
        )
        self.sensor.boot()
        self.sensor.receive(frames.NMT, frames.pack_nmt(NmtCommand.START, 2))
        self.sent.clear()

    def read(self, rotation: float) -> float:
        self.rotation = rotation
        self.sensor.receive(frames.SYNC, frames.pack_sync(1))
        identifier, data = self.sent.pop()
        assert identifier == 0x182
        return decode_rotation(data)


def test_bytes() -> None:
    bench = Bench()
    bench.rotation = -0.1
    bench.sensor.receive(frames.SYNC, frames.pack_sync(1))
    assert bench.sent == [(0x182, bytes.fromhex("6079feff"))]


def test_encoder_steps() -> None:
    bench = Bench()
    assert bench.read(0.12344) == pytest.approx(0.1234, abs=1e-12)
    assert bench.read(-0.12346) == pytest.approx(-0.1235, abs=1e-12)
    assert Bench(quantum=0.0).read(0.1234567) == pytest.approx(0.123457, abs=1e-12)


def test_noise_has_its_spread_and_its_seed() -> None:
    readings = [Bench(noise=1e-3, quantum=0.0, rng=np.random.default_rng(3)).read(0.1) for _ in range(2)]
    assert readings[0] == readings[1] != 0.1
    bench = Bench(noise=1e-3, quantum=0.0, rng=np.random.default_rng(3))
    spread = np.std([bench.read(0.1) for _ in range(2000)])
    assert spread == pytest.approx(1e-3, rel=0.1)


def test_noise_without_generator_is_refused() -> None:
    with pytest.raises(ValueError, match="needs a random generator"):
        Bench(noise=1e-3)


def test_silent_unless_operational_and_malformed_counted() -> None:
    bench = Bench()
    bench.sensor.receive(frames.SYNC, b"")
    bench.sensor.receive(frames.NMT, b"\x01")
    assert bench.sensor.node.refused_frames == 2
    bench.sensor.receive(frames.NMT, frames.pack_nmt(NmtCommand.STOP, 0))
    bench.sensor.receive(frames.SYNC, frames.pack_sync(1))
    assert bench.sent == []


def test_a_rotation_that_is_no_number_is_not_sent() -> None:
    with pytest.raises(FrameError, match="rotation"):
        Bench(quantum=0.0).read(math.inf)
