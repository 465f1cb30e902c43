"""The measured transfer function against closed forms, and its own statement of error."""

from __future__ import annotations

import math

import numpy as np
import pytest

from excitation import CosineWave
from tests.twin.tuning.plants import SINE, H, Setting, Table
from twin.tuning.reproduction import Measurement
from twin.tuning.transfer import FLOOR, HIGHEST, TRUSTED, TransferFunction


def measured(table: Table, runs: int = 3, pulse=SINE) -> TransferFunction:
    setting = Setting.of(pulse)
    transfer = TransferFunction(setting.window.size, H)
    measurement = Measurement(setting.window, transfer)
    for _ in range(runs):
        transfer.add(measurement.command(setting.command), measurement.answer(table(setting.command)))
    return transfer


@pytest.mark.parametrize("table", [Table(noise=0.0, encoder=0.0, delay=d) for d in (0, 1, 20)])
def test_without_noise_it_is_the_closed_form(table: Table) -> None:
    transfer = measured(table, runs=1)
    f = transfer.frequencies
    near = (f > 0.5) & (f < 60.0)
    # Averaged over 2 Hz: what bends within 2 Hz is smoothed a little.
    assert transfer.estimate[near] == pytest.approx(table.response(f[near]), abs=0.03)
    # Where the sine has no power of its own (every 4 Hz) its neighbours speak, and none of them speaks for all.
    assert np.min(transfer.coherence[near]) > 0.97
    assert np.mean(transfer.coherence[near]) > 0.99


def test_the_stated_error_is_the_error() -> None:
    """Over many noisy estimates, the spread of |H| is what one estimate states of itself."""
    sizes, stated = [], []
    for seed in range(60):
        transfer = measured(Table(seed=seed, noise=0.1), runs=2)
        f = transfer.frequencies
        at = [int(np.argmin(np.abs(f - frequency))) for frequency in (6.0, 14.0, 18.0, 22.0)]
        sizes.append(np.abs(transfer.estimate[at]))
        stated.append(transfer.error[at])
    true = np.std(sizes, axis=0) / np.mean(sizes, axis=0)
    assert np.median(stated, axis=0) == pytest.approx(true, rel=0.5)


def test_more_runs_are_worth_the_root_of_their_number() -> None:
    few, many = measured(Table(noise=0.1), runs=3), measured(Table(noise=0.1), runs=48)
    at = int(np.argmin(np.abs(few.frequencies - 18.0)))
    assert many.error[at] == pytest.approx(few.error[at] / 4.0, rel=0.35)
    assert many.highest > few.highest


def test_noise_alone_is_not_trusted() -> None:
    transfer = TransferFunction(1000, H)
    rng = np.random.default_rng(4)
    for _ in range(20):
        transfer.add(transfer.spectrum(rng.standard_normal(1000)), transfer.spectrum(rng.standard_normal(1000)))
    assert np.mean(transfer.band) < 0.02
    assert np.mean(transfer.coherence) < 0.1


def test_what_was_not_commanded_is_not_corrected() -> None:
    transfer = TransferFunction(1000, H)
    t = np.arange(1000) * H
    burst = np.sin(2.0 * math.pi * 10.0 * t) * np.exp(-0.5 * ((t - 0.5) / 0.1) ** 2)
    transfer.add(transfer.spectrum(burst), transfer.spectrum(0.5 * burst))
    f = transfer.frequencies
    assert transfer.estimate[np.argmin(np.abs(f - 10.0))] == pytest.approx(0.5, abs=1e-3)
    assert np.all(transfer.inverse[f > 60.0] == pytest.approx(0.0, abs=1e-6))
    assert np.all(np.isfinite(transfer.inverse))


def test_the_inverse_is_bounded_and_ends_below_the_cycle_rate() -> None:
    transfer = measured(Table(noise=0.0, encoder=0.0), pulse=CosineWave(2.943, 4.0))
    f = transfer.frequencies
    assert np.max(np.abs(transfer.inverse)) <= 0.5 / FLOOR * (1.0 + 1e-9)
    assert np.all(np.abs(transfer.inverse[f > HIGHEST / H + 10.0]) < 1e-6)
    # Where the table follows well, the inverse undoes it.
    slow = (f > 1.0) & (f < 10.0)
    assert transfer.inverse[slow] * transfer.estimate[slow] == pytest.approx(1.0 / (1.0 + FLOOR**2), abs=0.02)


def test_nothing_is_known_before_a_run() -> None:
    transfer = TransferFunction(500, H)
    assert np.all(transfer.estimate == 0.0)
    assert np.all(transfer.band == 0.0)
    assert np.all(transfer.error > TRUSTED)
    assert transfer.highest == 0.0
