"""The public surface."""

from __future__ import annotations

import subprocess
import sys

import pytest

import recordings


def test_public_names() -> None:
    assert recordings.__all__ == sorted(recordings._MODULES, key=recordings.__all__.index)
    for name in recordings.__all__:
        assert getattr(recordings, name).__name__ == name
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        _ = recordings.nothing


def test_recording_does_not_load_rerun() -> None:
    code = "import sys; from recordings import LiveView, Recorder, read_run; sys.exit('rerun' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
