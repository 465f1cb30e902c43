"""Errors of a set of runs: nothing is invented, nothing is hidden."""

from __future__ import annotations

import math

import numpy as np
import pytest

from excitation import CosineWave, Motion
from tests.twin.tuning.plants import SINE, H, Setting, Table
from twin.errors import InputError
from twin.tuning.reproduction import QUIET, Measurement, Reproduction
from twin.tuning.transfer import TransferFunction
from twin.tuning.window import RAMP, Trace, window_of


def judged(setting: Setting, traces: list[Trace]) -> Reproduction:
    return Measurement(setting.window, TransferFunction(setting.window.size, H)).errors(traces)


def delayed(setting: Setting, delay: float, size: float = 1.0) -> Trace:
    t = np.arange(setting.command.size) * H - delay
    return Trace(
        np.array([setting.motion.displacement(x) for x in np.maximum(t, 0.0)]),
        size * setting.motion.acceleration(np.maximum(t, 0.0)),
    )


def test_what_is_performed_as_asked_has_no_error() -> None:
    setting = Setting.of(SINE)
    r = judged(setting, [delayed(setting, 0.0)] * 3)
    # But for the kinks at both ends, above the 100 Hz that are listened to.
    assert r.rms < 2e-3
    assert r.peak < 0.015
    assert max(r.rms_error, r.spread, r.noise) < 1e-15
    assert abs(r.lag) < 1e-4


@pytest.mark.parametrize("lag", [-0.012, 0.0031, 0.02])
def test_a_lag_is_told_from_a_wrong_shape(lag: float) -> None:
    setting = Setting.of(SINE)
    r = judged(setting, [delayed(setting, lag)] * 2)
    assert r.lag == pytest.approx(lag, abs=1e-4)
    assert r.shape < 2e-3
    assert r.rms > 0.02


def test_a_wrong_size_is_a_wrong_shape() -> None:
    setting = Setting.of(SINE)
    r = judged(setting, [delayed(setting, 0.0, 0.9)] * 2)
    over = setting.window.acceleration[setting.window.judged]
    assert r.rms == pytest.approx(0.1 * math.sqrt(np.mean(over**2)) / setting.window.peak, rel=0.02)
    assert r.peak == pytest.approx(0.1, abs=0.01)
    assert r.shape == pytest.approx(r.rms, rel=0.02)
    # The encoder saw all of it: the sensors disagree by as much.
    assert r.sensors == pytest.approx(r.rms, rel=0.05)


def test_noise_is_stated_for_what_it_is() -> None:
    setting = Setting.of(SINE)
    rng = np.random.default_rng(1)
    ideal = delayed(setting, 0.0)
    noise = 0.1
    size = ideal.acceleration.size
    traces = [Trace(ideal.position, ideal.acceleration + noise * rng.standard_normal(size)) for _ in range(20)]
    r = judged(setting, traces)
    # White to 500 Hz, heard to 100 Hz.
    expected = noise * math.sqrt(QUIET / 500.0) / setting.window.peak
    assert r.spread == pytest.approx(expected, rel=0.15)
    assert r.noise == pytest.approx(expected / math.sqrt(20.0), rel=0.15)
    assert r.rms == pytest.approx(r.noise, rel=0.4)
    assert 0.0 < r.rms_error < r.rms


def test_the_bias_of_the_accelerometer_is_no_error() -> None:
    setting = Setting.of(SINE)
    ideal = delayed(setting, 0.0)
    biased = Trace(ideal.position, ideal.acceleration + 0.5)
    assert judged(setting, [biased] * 2).rms == pytest.approx(judged(setting, [ideal] * 2).rms, abs=1e-12)


def test_the_shortfall_brings_the_table_back_to_what_was_asked() -> None:
    """A table that does exactly what it is told, told something else: the shortfall is the difference, to the end."""
    setting = Setting.of(CosineWave(2.0, 4.0))
    window = setting.window
    transfer = TransferFunction(window.size, H)
    measurement = Measurement(window, transfer)
    t = (np.arange(window.size) * H + window.start) / SINE.duration
    wrong = np.where((t > 0.0) & (t < 1.0), 1e-3 * np.sin(math.pi * t) ** 4, 0.0)
    command = setting.command.copy()
    window.cut(command)[:] += wrong
    acceleration = np.zeros(command.size)
    window.cut(acceleration)[:] = window.curvature(command)
    missing = transfer.samples(measurement.shortfall([Trace(command, acceleration + 0.3)]), window.size)
    # 0.3 m/s2 of bias, integrated twice, would be 150 mm.
    assert missing == pytest.approx(-wrong, abs=5e-6)


def test_an_accelerometer_that_drifts_does_not_move_the_table() -> None:
    """A drift of 0.05 m/s2 over a second would be 8 mm, integrated twice: the encoder knows better."""
    setting = Setting.of(SINE)
    window = setting.window
    transfer = TransferFunction(window.size, H)
    ideal = delayed(setting, 0.0)
    drift = 0.05 * np.clip((np.arange(ideal.acceleration.size) - window.first) / 1000.0, 0.0, 1.0)
    measurement = Measurement(window, transfer)
    still = transfer.samples(measurement.shortfall([ideal]), window.size)
    moved = transfer.samples(measurement.shortfall([Trace(ideal.position, ideal.acceleration + drift)]), window.size)
    assert np.max(np.abs(moved - still)) < 1e-3


def test_windows() -> None:
    setting = Setting.of(SINE)
    window = setting.window
    assert window.peak == pytest.approx(SINE.amplitude, rel=1e-4)
    assert window.jump == pytest.approx(0.0, abs=1e-9)
    assert Setting.of(CosineWave(2.0, 4.0)).window.jump == pytest.approx(2.0)
    assert window.start == pytest.approx(-0.3, abs=1e-3)
    assert window.curvature(setting.command) == pytest.approx(window.asked_curvature, abs=1e-6)
    assert window.fade[0] == window.fade[-1] == 0.0
    assert np.all(window.fade[round(RAMP / H) + 1 : -round(RAMP / H) - 1] == 1.0)
    with pytest.raises(InputError, match=r"pauses of 0\.02 s beside the pulse are too short"):
        window_of(Motion(SINE, 1.09, settle=1.0), H, 0.02)


def test_one_run_does_not_tell_chance_from_error() -> None:
    setting = Setting.of(SINE)
    one = judged(setting, [delayed(setting, 0.01)])
    assert math.isnan(one.spread)
    assert math.isnan(one.rms_error)
    assert one.rms == pytest.approx(judged(setting, [delayed(setting, 0.01)] * 2).rms)


def test_equal_tables_equal_errors() -> None:
    setting = Setting.of(SINE)
    results = [judged(setting, [table(setting.command) for _ in range(3)]) for table in (Table(seed=5), Table(seed=5))]
    assert results[0].rms == results[1].rms
    assert results[0].lag == pytest.approx(2 * 0.78 / (2 * math.pi * 31.9) + H, abs=1e-3)
