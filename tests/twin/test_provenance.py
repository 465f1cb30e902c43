"""Which code a recording was made by: read from the repository's files, without a program to ask."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest

from twin.provenance import OWN_PACKAGES, ROOT, git_revision, source_digest, versions

GIT = ["git", "-c", "user.name=t", "-c", "user.email=t@t", "-c", "commit.gpgsign=false"]


def _git(folder: Path, *arguments: str) -> str:
    done = subprocess.run([*GIT, *arguments], cwd=folder, capture_output=True, text=True, timeout=30, check=True)
    return done.stdout.strip()


@pytest.fixture
def repository(tmp_path: Path) -> Path:
    folder = tmp_path / "checkout"
    folder.mkdir()
    try:
        _git(folder, "init", "--initial-branch=trunk")
    except (OSError, subprocess.CalledProcessError):
        pytest.skip("no git here")
    _git(folder, "commit", "--allow-empty", "--message=one")
    return folder


def test_the_revision_is_gits(repository: Path) -> None:
    head = _git(repository, "rev-parse", "HEAD")
    assert git_revision(repository) == head
    _git(repository, "pack-refs", "--all")
    assert not (repository / ".git/refs/heads/trunk").exists()
    assert git_revision(repository) == head
    _git(repository, "checkout", "--detach")
    assert git_revision(repository) == head
    _git(repository, "commit", "--allow-empty", "--message=two")
    assert git_revision(repository) == _git(repository, "rev-parse", "HEAD") != head


def test_the_revision_of_a_worktree_is_its_own(repository: Path, tmp_path: Path) -> None:
    _git(repository, "worktree", "add", "-b", "side", str(tmp_path / "side"))
    _git(tmp_path / "side", "commit", "--allow-empty", "--message=aside")
    assert git_revision(tmp_path / "side") == _git(tmp_path / "side", "rev-parse", "HEAD")
    assert git_revision(tmp_path / "side") != git_revision(repository)


@pytest.mark.parametrize("content", ["", "ref: refs/heads/none", "ref: ", "../../etc/passwd", "0" * 39, "\x00"])
def test_what_is_no_revision_is_unknown(tmp_path: Path, content: str) -> None:
    assert git_revision(tmp_path) == "unknown"
    (tmp_path / ".git").mkdir()
    (tmp_path / ".git" / "HEAD").write_text(content, encoding="utf-8")
    assert git_revision(tmp_path) == "unknown"


def test_the_digest_follows_every_source_file_and_nothing_else(tmp_path: Path) -> None:
    for name in OWN_PACKAGES:
        (tmp_path / name).mkdir()
        (tmp_path / name / "__init__.py").write_text("x = 1\n")
    before = source_digest(tmp_path)
    (tmp_path / "twin" / "notes.txt").write_text("not a program")
    assert source_digest(tmp_path) == before
    (tmp_path / "recordings" / "__init__.py").write_text("x = 2\n")
    assert source_digest(tmp_path) != before
    (tmp_path / "recordings" / "__init__.py").write_text("x = 1\n")
    (tmp_path / "devices" / "__init__.py").rename(tmp_path / "devices" / "other.py")
    assert source_digest(tmp_path) != before


def test_versions_say_both() -> None:
    found = versions()
    assert found["git"] == git_revision(ROOT)
    assert found["source"] == source_digest()[:16]
    assert found["mcap"] != "not installed"
