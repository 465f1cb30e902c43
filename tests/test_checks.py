"""Every check of the project that is not a test, as one: format, lint, types, import arrows, what must stay out."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent

CHECKS = {
    "format": [sys.executable, "-m", "ruff", "format", "--check", "."],
    "lint": [sys.executable, "-m", "ruff", "check", "."],
    "types": [sys.executable, "-m", "basedpyright"],
    "arrows": [sys.executable, "-c", "from importlinter.cli import lint_imports_command; lint_imports_command()"],
}


@pytest.mark.parametrize("name", CHECKS)
def test_check(name: str) -> None:
    done = subprocess.run(CHECKS[name], cwd=ROOT, capture_output=True, text=True, timeout=600)
    assert done.returncode == 0, f"{done.stdout}\n{done.stderr}"


def test_no_registry_address_in_the_tree() -> None:
    """Lock files and anything else that records where packages came from stay out of the repository."""
    pattern = re.compile(r"https?://[^ \"]+(/simple|/packages/|\.tgz|\.whl|\.deb)")
    for path in ROOT.rglob("*"):
        hidden = any(part.startswith(".") or part in ("runs", "build", "dist") for part in path.relative_to(ROOT).parts)
        if path.is_file() and not hidden and path.suffix in (".toml", ".md", ".txt", ".cfg", ".lock", ".json"):
            assert not pattern.search(path.read_text(encoding="utf-8", errors="ignore")), path


def test_modules_stay_small() -> None:
    for folder in ("twin", "excitation", "devices", "recordings"):
        for path in (ROOT / folder).rglob("*.py"):
            assert len(path.read_text(encoding="utf-8").splitlines()) <= 300, path
