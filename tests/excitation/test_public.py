"""The public surface, and that it is light to import."""

from __future__ import annotations

import subprocess
import sys

import excitation


def test_the_public_names() -> None:
    assert sorted(excitation.__all__) == [
        "Capacity",
        "Clipped",
        "ConstantPulse",
        "CosineWave",
        "DoublePulse",
        "Limit",
        "Motion",
        "Phase",
        "Pulse",
        "Ramped",
        "Record",
        "ReleasedMachine",
        "ReleasedRun",
        "Saturated",
        "SineWave",
        "TableRun",
        "Wave",
        "clip",
    ]
    assert all(hasattr(excitation, name) for name in excitation.__all__)


def test_importing_it_loads_numpy_and_pydantic_only() -> None:
    heavy = ["scipy", "numba", "can", "mcap", "rerun", "matplotlib", "twin", "devices", "recordings"]
    code = f"import sys, excitation; print([name for name in {heavy!r} if name in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
