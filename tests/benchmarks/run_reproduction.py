"""What the emulated ST-III makes of a sine and a cosine: `python tests/benchmarks/run_reproduction.py [--payload KG]`.

No bus and no noise: the table's true acceleration beside the asked one, from 0.05 s before the pulse to 0.1 s after it,
as shares of the asked peak; and the same from the transfer function alone, which knows no saturation and no cycle.
"""

from __future__ import annotations

import argparse
import math
import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from devices.quanser_st3.capacity import CAPACITY
from devices.quanser_st3.parameters import St3Parameters
from devices.quanser_st3.plant import St3Plant
from excitation import CosineWave, Motion, SineWave

H = 1e-3
BEFORE, AFTER = 0.05, 0.1


def errors(achieved: np.ndarray, asked: np.ndarray) -> tuple[float, float]:
    """Return root mean square and largest difference, as shares of the asked peak."""
    peak, difference = np.abs(asked).max(), achieved - asked
    return float(np.sqrt(np.mean(difference**2)) / peak), float(np.abs(difference).max() / peak)


def main() -> None:
    """Print one line a pulse."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--payload", type=float, default=2.5692, help="kg (default: block B6L)")
    payload = parser.parse_args().payload
    parameters = St3Parameters()
    loop = parameters.loop(payload)
    print(f"loop {loop.angular_frequency / math.tau:.2f} Hz, damping {loop.damping:.3f}, lag {loop.delay * 1e3:.2f} ms")
    for pulse in (SineWave(0.3 * 9.81, 4.0), CosineWave(0.3 * 9.81, 4.0)):
        motion = Motion(pulse, 1.0, capacity=CAPACITY)
        times = np.arange(1, math.ceil(motion.duration / H) + 1) * H
        targets, asked = motion.displacement(times), motion.acceleration(times)
        plant = St3Plant(parameters, H, np.random.default_rng(1), payload=payload)
        achieved = np.zeros_like(times)
        for k, target in enumerate(targets.tolist()):
            plant.advance(target)
            achieved[k] = plant.acceleration
        start = motion.pulse_start
        judged = (times >= start - BEFORE) & (times <= start + pulse.duration + AFTER)
        # The transfer function on a finely sampled motion, long enough to come round at rest.
        fine = np.arange(0.0, motion.duration + 1.0, 0.1 * H)
        wave = np.where(fine < motion.duration, motion.acceleration(np.minimum(fine, motion.duration)), 0.0)
        frequencies = np.fft.rfftfreq(len(fine), 0.1 * H)
        response = np.array([loop.response(float(f)) for f in frequencies])
        ideal = np.interp(times, fine, np.fft.irfft(np.fft.rfft(wave) * response, len(fine)))
        late = np.interp(times[judged] - loop.delay, fine, wave)
        rows = {
            "emulated": errors(achieved[judged], asked[judged]),
            "transfer function": errors(ideal[judged], asked[judged]),
            "emulated, lag taken out": errors(achieved[judged], late),
        }
        for name, (rms, most) in rows.items():
            print(f"{pulse.kind:14} {name:24} {rms:7.2%} rms, {most:7.2%} at most of {np.abs(asked).max():.3f} m/s2")


if __name__ == "__main__":
    main()
