"""Devices by name: those that ship, those of installed packages, and nothing that only lies about."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

import devices
from devices import installed
from devices.catalogue import catalogue, find_device, unusable_devices
from devices.errors import UnknownDevice
from devices.installed import device_folders, site_folders
from devices.quanser_st3.driver import open_table
from devices.quanser_st3.emulator import EmulatedSt3

CAPACITY = 'name = "{name}"\nstroke_mm = 100.0\nvelocity_m_s = 0.5\nacceleration_g = 0.5\n'
CODE = """
from importlib.resources import files
from devices.capacity_file import load_capacity
CAPACITY = load_capacity(files(__package__).joinpath("capacity.toml").read_text(encoding="utf-8"))
"""


def write_folder(home: Path, name: str) -> Path:
    folder = home / name
    folder.mkdir(parents=True)
    (folder / "__init__.py").write_text('"""A table for tests: one line.\n\nAnd more."""\n')
    (folder / "capacity.toml").write_text(CAPACITY.format(name=name))
    (folder / "capacity.py").write_text(CODE)
    return folder


def install(place: Path, name: str, package: str, extra: dict[str, str] | None = None) -> None:
    """Write what pip writes beside a package."""
    info = place / f"{name}_package-1.0.dist-info"
    info.mkdir(parents=True)
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}-package\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(f"[{installed.GROUP}]\n{name} = {package}\n")
    for file, text in (extra or {}).items():
        (info / file).write_text(text)


@pytest.fixture(autouse=True)
def as_before() -> Iterator[None]:
    """Forget the modules a test imported."""
    known = set(sys.modules)
    yield
    for name in set(sys.modules) - known:
        if name.partition(".")[2].partition(".")[0] == "bench_table" or name.partition(".")[0].endswith("_table"):
            del sys.modules[name]


@pytest.fixture
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return a folder in which packages are installed, for this interpreter and this test."""
    folder = tmp_path / "site"
    folder.mkdir()
    monkeypatch.syspath_prepend(str(folder))
    monkeypatch.setattr(installed, "site_folders", lambda: [folder])
    return folder


def test_each_device_answers_with_its_own_name() -> None:
    assert set(catalogue()) >= {"quanser_st3", "air_track", "roori1"}
    for name, entry in catalogue().items():
        assert find_device(name) == entry
        assert entry.capacity.name == name
        assert 10 < len(entry.description) < 150
    assert unusable_devices() == []


def test_factories() -> None:
    assert find_device("quanser_st3").open_table is open_table
    assert find_device("quanser_st3").emulator is EmulatedSt3


def test_what_is_not_there_is_one_sentence() -> None:
    with pytest.raises(UnknownDevice, match=r"no device is called 'st3'; there are .*quanser_st3"):
        find_device("st3")


def test_a_folder_with_a_capacity_is_a_device(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write_folder(tmp_path, "bench_table")
    (tmp_path / "no_device").mkdir()
    (tmp_path / "no_device" / "__init__.py").write_text("")
    monkeypatch.setattr(devices, "__path__", [*devices.__path__, str(tmp_path)])
    entry = find_device("bench_table")
    assert entry.capacity.stroke == 0.1
    assert entry.description == "A table for tests: one line"
    assert "no_device" not in catalogue()
    with pytest.raises(UnknownDevice, match="bench_table has no driver yet"):
        _ = entry.open_table
    with pytest.raises(UnknownDevice, match="bench_table has no emulator yet"):
        _ = entry.emulator


def test_an_installed_package_offers_a_device(place: Path) -> None:
    write_folder(place, "lab_table")
    install(place, "lab_table", "lab_table")
    assert find_device("lab_table").capacity.velocity == 0.5
    assert unusable_devices() == []


def test_an_editable_install_may_lie_elsewhere(place: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    project = tmp_path / "my project"
    write_folder(project, "edited_table")
    monkeypatch.syspath_prepend(str(project))
    install(place, "edited_table", "edited_table")
    assert "edited_table" not in catalogue()
    (place / "edited_table_package-1.0.dist-info" / "direct_url.json").write_text(
        f'{{"url": "{project.as_uri()}", "dir_info": {{"editable": true}}}}'
    )
    assert find_device("edited_table").capacity.stroke == 0.1


def test_the_current_folder_offers_nothing(place: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Started in a folder somebody else prepared, with that folder first on the path, as `python -m` has it."""
    here = tmp_path / "here"
    folder = write_folder(here, "trap")
    (folder / "__init__.py").write_text("raise SystemExit('run from the current folder')")
    install(here, "trap", "trap")
    monkeypatch.chdir(here)
    monkeypatch.syspath_prepend(str(here))
    assert "trap" not in catalogue()
    # Nor is it run in the place of an installed one.
    write_folder(place, "trap")
    install(place, "trap", "trap")
    assert "trap" not in catalogue()
    (problem,) = unusable_devices()
    assert problem.startswith("device trap of package trap: it would be loaded from")
    with pytest.raises(UnknownDevice, match="which is not where it is installed"):
        find_device("trap")


def test_a_shipped_device_cannot_be_replaced(place: Path) -> None:
    write_folder(place, "other_st3")
    install(place, "quanser_st3", "other_st3")
    assert find_device("quanser_st3").package == "devices.quanser_st3"
    assert unusable_devices() == ["device quanser_st3 of package other_st3: there is another one of that name"]


@pytest.mark.parametrize(
    ("package", "said"),
    [
        ("lab_table:open", "must be plain names"),
        ("os.system('x')", "must be plain names"),
        ("not_there", "there is no package not_there"),
    ],
)
def test_an_entry_point_that_is_none(package: str, said: str, place: Path) -> None:
    install(place, "lab_table", package)
    assert "lab_table" not in catalogue()
    assert any(said in problem for problem in unusable_devices())


@pytest.mark.parametrize(
    ("file", "text", "said"),
    [
        ("capacity.toml", "stroke_mm = 1.0", "has no 'name'"),
        ("capacity.py", "import not_a_package", "cannot be imported"),
        ("capacity.py", "", "has no CAPACITY"),
    ],
)
def test_a_device_that_cannot_be_used_is_one_sentence(file: str, text: str, said: str, place: Path) -> None:
    folder = write_folder(place, "lab_table")
    (folder / file).write_text(text)
    install(place, "lab_table", "lab_table")
    (problem,) = unusable_devices()
    assert problem.startswith("device lab_table: ")
    assert said in problem
    assert "\n" not in problem


def test_an_emulator_module_has_one_emulator(place: Path) -> None:
    folder = write_folder(place, "lab_table")
    install(place, "lab_table", "lab_table")
    (folder / "emulator.py").write_text("from devices.emulation import Emulation\n")
    with pytest.raises(UnknownDevice, match=r"lab_table\.emulator has 0 classes derived from Emulation"):
        _ = find_device("lab_table").emulator


def test_packages_are_installed_where_the_interpreter_says() -> None:
    assert all(folder.is_absolute() for folder in site_folders())
    assert Path.cwd() not in site_folders()
    assert [folder.name for folder in device_folders([])] == sorted(
        entry.name for entry in catalogue().values() if entry.package.startswith("devices.")
    )
