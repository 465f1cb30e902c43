"""Which code on which machine: what a recording needs to say whether a replay must be equal to the bit."""

from __future__ import annotations

import platform
import subprocess
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import cast

from twin.rocking.compiled import SOURCE_DIGEST

NUMERIC_PACKAGES = ("shake-table-twin", "numpy", "numba", "llvmlite")
"""Packages that take part in a prediction; equal versions on equal processors give equal bits."""
OTHER_PACKAGES = ("scipy", "pydantic", "python-can", "mcap", "protobuf", "rerun-sdk")


def versions() -> dict[str, str]:
    """Return the versions of Python, this project and its packages, and the git revision where there is one."""
    found = {"python": platform.python_version()}
    for name in (*NUMERIC_PACKAGES, *OTHER_PACKAGES):
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            found[name] = "not installed"
    found["git"] = git_revision()
    found["solver"] = SOURCE_DIGEST[:16]
    return found


def git_revision() -> str:
    """Return the revision of the checkout this package lies in, with "+" where it was changed; "none" outside one."""
    folder = Path(__file__).resolve().parent.parent
    if not (folder / ".git").exists():
        return "none"
    try:
        head = _git(folder, "rev-parse", "HEAD")
        changed = _git(folder, "status", "--porcelain", "--untracked-files=no")
    except (OSError, subprocess.SubprocessError):
        return "none"
    return head + ("+" if changed else "")


def _git(folder: Path, *arguments: str) -> str:
    done = subprocess.run(  # noqa: S603
        ["git", "-C", str(folder), *arguments],  # noqa: S607
        capture_output=True,
        text=True,
        timeout=5,
        check=True,
    )
    return done.stdout.strip()


def processor() -> dict[str, str]:
    """Return the processor's name and the features the compiler may use."""
    import llvmlite.binding as llvm  # pyright: ignore[reportMissingTypeStubs]

    features = cast("dict[str, bool]", llvm.get_host_cpu_features())
    return {
        "machine": platform.machine(),
        "system": platform.system(),
        "name": str(llvm.get_host_cpu_name()),
        "features": ",".join(sorted(name for name, present in features.items() if present)),
    }


def same_arithmetic(recorded_versions: dict[str, str], recorded_processor: dict[str, str]) -> list[str]:
    """Return what differs between a recording and here that could change a bit; empty where nothing does."""
    here = versions()
    names = (*NUMERIC_PACKAGES, "python", "solver")
    changed = [
        f"{name} {recorded_versions.get(name, 'unknown')} then, {here[name]} now"
        for name in names
        if recorded_versions.get(name) != here[name]
    ]
    now = processor()
    if any(recorded_processor.get(key) != now[key] for key in now):
        changed.append(f"processor {recorded_processor.get('name', 'unknown')} then, {now['name']} now")
    return changed
