"""Sensors that lie, and that tell the truth as long as nothing is wrong."""

from __future__ import annotations

import numpy as np
import pytest

from devices.clock import ManualClock
from devices.faults.catalogue import parse_fault
from devices.faults.schedule import Schedule
from devices.faults.sensors import FaultyAccelerometer, FaultyEncoder
from devices.sensors.accelerometer import Accelerometer
from devices.sensors.encoder import Encoder

H = 1e-3


def readings(kind: type[FaultyEncoder | FaultyAccelerometer], inner: object, *faults: str) -> list[float]:
    clock = ManualClock()
    schedule = Schedule([parse_fault(fault) for fault in faults], clock, H)
    sensor = kind(inner, schedule)
    schedule.start()
    found = []
    for k in range(20):
        clock.wait_until(k * H)
        found.append(sensor.read(0.01 * k))
    return found


TRUE = [pytest.approx(0.01 * k) for k in range(20)]


@pytest.mark.parametrize("kind", [FaultyEncoder, FaultyAccelerometer])
def test_the_truth_before_and_after(kind: type) -> None:
    assert readings(kind, Encoder(0.0)) == TRUE
    assert readings(kind, Encoder(0.0), "encoder_frozen@1", "accelerometer_stuck@1") == TRUE


def test_encoder() -> None:
    glitch = readings(FaultyEncoder, Encoder(0.0), "encoder_glitch@0.005:0.2")
    assert glitch[5] == pytest.approx(0.25)
    assert glitch[:5] + glitch[6:] == TRUE[:5] + TRUE[6:]
    frozen = readings(FaultyEncoder, Encoder(0.0), "encoder_frozen@0.005")
    assert frozen == TRUE[:5] + [frozen[4]] * 15


def test_accelerometer() -> None:
    stuck = readings(FaultyAccelerometer, Encoder(0.0), "accelerometer_stuck@0.005")
    assert stuck == TRUE[:5] + [stuck[4]] * 15
    saturated = readings(FaultyAccelerometer, Encoder(0.0), "accelerometer_saturated@0.005:-9")
    assert saturated == TRUE[:5] + [-9.0] * 15
    biased = readings(FaultyAccelerometer, Encoder(0.0), "accelerometer_biased@0.005:3")
    assert biased == TRUE[:5] + [pytest.approx(3.0 + 0.01 * k) for k in range(5, 20)]


def test_the_noise_behind_it_goes_on() -> None:
    """After a fault that ends, and in every other part of the run, the numbers drawn are those of a run without it."""

    def sensor() -> Accelerometer:
        return Accelerometer(np.random.default_rng(3), noise=0.1, bias=0.0, largest=50.0)

    assert readings(FaultyAccelerometer, sensor(), "accelerometer_biased@0.005:3")[10] == pytest.approx(
        3.0 + readings(FaultyAccelerometer, sensor())[10]
    )
