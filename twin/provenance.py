"""Which code on which machine: what a recording needs to say whether a replay must be equal to the bit."""

from __future__ import annotations

import platform
from hashlib import sha256
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import cast

from twin.rocking.compiled import SOURCE_DIGEST

NUMERIC_PACKAGES = ("shake-table-twin", "numpy", "numba", "llvmlite")
"""Packages that take part in a prediction; equal versions on equal processors give equal bits."""
OTHER_PACKAGES = (
    "scipy",
    "pydantic",
    "python-can",
    "mcap",
    "lz4",
    "protobuf",
    "foxglove-schemas-protobuf",
    "rerun-sdk",
)
OWN_PACKAGES = ("devices", "excitation", "recordings", "twin")
ROOT = Path(__file__).resolve().parent.parent
"""Where this project's packages lie: a checkout, or where packages are installed."""


def versions() -> dict[str, str]:
    """Return the versions of Python, this project and its packages, the git revision and digests of the sources."""
    found = {"python": platform.python_version()}
    for name in (*NUMERIC_PACKAGES, *OTHER_PACKAGES):
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            found[name] = "not installed"
    found["git"] = git_revision()
    found["source"] = source_digest()[:16]
    found["solver"] = SOURCE_DIGEST[:16]
    return found


def git_revision(folder: Path = ROOT) -> str:
    """Return the revision of the checkout at `folder`, read from its files; "unknown" where it is none.

    A checkout may have been changed since: `source_digest` tells.
    """
    try:
        place = folder / ".git"
        if place.is_file():
            # A worktree: the file says where its own part of the repository is, that where the common part is.
            place = folder / place.read_text(encoding="utf-8").partition("gitdir:")[2].strip()
        head = (place / "HEAD").read_text(encoding="utf-8").strip()
        if not head.startswith("ref: "):
            return _revision(head)
        shared = place / "commondir"
        common = place / shared.read_text(encoding="utf-8").strip() if shared.is_file() else place
        name = head.removeprefix("ref: ")
        for loose in (place / name, common / name):
            if loose.is_file():
                return _revision(loose.read_text(encoding="utf-8").strip())
        packed = (common / "packed-refs").read_text(encoding="utf-8").splitlines()
        return _revision(next(line.split()[0] for line in packed if line.endswith(f" {name}")))
    except (OSError, ValueError, StopIteration, IndexError):
        return "unknown"


def _revision(text: str) -> str:
    """Return `text` where it is a revision, SHA-1 or SHA-256; "unknown" otherwise."""
    return text if len(text) in (40, 64) and set(text) <= set("0123456789abcdef") else "unknown"


def source_digest(root: Path = ROOT) -> str:
    """Return a digest of the project's own Python files, names and contents: equal digests are equal programs."""
    digest = sha256()
    for name in OWN_PACKAGES:
        for path in sorted((root / name).rglob("*.py")):
            digest.update(path.relative_to(root).as_posix().encode() + b"\0")
            digest.update(path.read_bytes() + b"\0")
    return digest.hexdigest()


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
