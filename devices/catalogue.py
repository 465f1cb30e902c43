"""Devices by name, for the command line only; everything below it is handed values. Imports are lazy.

A device is a folder: `capacity.toml` and `capacity.py` (`CAPACITY`), and where they exist `driver.py` (`open_table`)
and `emulator.py` (one class derived from `Emulation`). Nothing is listed here: see `devices.installed`.
"""

from __future__ import annotations

import ast
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib import import_module
from importlib.resources import files
from typing import TYPE_CHECKING, Any, cast

from devices.errors import UnknownDevice
from devices.installed import CAPACITY, device_folders

if TYPE_CHECKING:
    from types import ModuleType

    from devices.cia402.master import Cia402Table
    from devices.emulation import Emulation
    from devices.own_table import OwnNumbers
    from devices.released_table import ReleasedTable
    from excitation import Capacity, ReleasedMachine


CIA402 = "cia402"
"""The driver every device has, `driver.py`."""


@dataclass(frozen=True, slots=True)
class CatalogueEntry:
    """One device: its name, and the package that holds its folder."""

    name: str
    package: str

    @property
    def description(self) -> str:
        """First line of the folder's docstring, without the full stop."""
        lines = (self._module("").__doc__ or self.name).strip().splitlines()
        return lines[0].rstrip(".")

    @property
    def has_driver(self) -> bool:
        """Whether the folder has a driver."""
        return self._has("driver.py")

    @property
    def has_emulator(self) -> bool:
        """Whether the folder has an emulator."""
        return self._has("emulator.py")

    @property
    def drivers(self) -> dict[str, str]:
        """The folder's drivers: name of the module -> first line of its docstring. None of them is imported."""
        self._module("")
        found: dict[str, str] = {}
        for file in sorted(files(self.package).iterdir(), key=lambda file: file.name):
            if file.name.endswith("driver.py"):
                text = ast.get_docstring(ast.parse(file.read_text(encoding="utf-8"))) or ""
                found[file.name.removesuffix(".py")] = text.partition("\n")[0].rstrip(".")
        return found

    @property
    def capacity(self) -> Capacity:
        """The folder's `CAPACITY`."""
        return cast("Capacity", self._attribute("capacity", "CAPACITY"))

    @property
    def machine(self) -> type[ReleasedMachine] | None:
        """What the table `[machine]` of a capacity file is read as; None for a table that follows set-points."""
        return cast("type[ReleasedMachine] | None", getattr(self._module("capacity"), "MACHINE", None))

    @property
    def open_table(self) -> Callable[..., Cia402Table | ReleasedTable]:
        """The folder's `driver.open_table`; UnknownDevice where there is no driver."""
        if not self.has_driver:
            raise UnknownDevice(f"{self.name} has no driver yet; it can only be planned for")
        return cast("Callable[..., Cia402Table | ReleasedTable]", self._attribute("driver", "open_table"))

    @property
    def emulator(self) -> Callable[..., Emulation]:
        """The folder's emulator; UnknownDevice where there is none."""
        from devices.emulation import Emulation

        if not self.has_emulator:
            raise UnknownDevice(f"{self.name} has no emulator yet; it can only be planned for")
        module = self._module("emulator")
        own = [
            value
            for value in vars(module).values()
            if isinstance(value, type) and issubclass(value, Emulation) and value.__module__ == module.__name__
        ]
        if len(own) != 1:
            raise UnknownDevice(f"{module.__name__} has {len(own)} classes derived from Emulation; it must have one")
        return own[0]

    @property
    def driver_names(self) -> tuple[str, ...]:
        """What `--driver` takes: `driver.py` speaks CiA 402, `hil_driver.py` is called "hil"."""
        return tuple(CIA402 if name == "driver" else name.removesuffix("_driver") for name in self.drivers)

    def driver(self, name: str) -> Any:
        """Return the module of a driver other than CiA 402: `check(table)` and `open_table(table, ...)`."""
        return self._module(f"{name}_driver")

    def parameters(self, table: Mapping[str, object]) -> OwnNumbers | None:
        """Return the emulator's numbers, a capacity file's `[emulator]` among them; None where none can be set.

        Raises
        ------
        ValueError
            One sentence: a wrong number, or a device whose folder has no `parameters.load_parameters`.
        """
        if self._has("parameters.py"):
            return cast("OwnNumbers", self._attribute("parameters", "load_parameters")(table))
        if table:
            raise ValueError(f"[emulator] is no use: the emulator of {self.name} has no numbers to set there")
        return None

    def _attribute(self, module: str, name: str) -> Any:
        found = self._module(module)
        try:
            return getattr(found, name)
        except AttributeError:
            raise UnknownDevice(f"{found.__name__} has no {name}: see the README on a new device") from None

    def _module(self, module: str) -> ModuleType:
        name = f"{self.package}.{module}".rstrip(".")
        try:
            return import_module(name)
        except ImportError as error:
            raise UnknownDevice(f"device {self.name}: {name} cannot be imported: {error}") from error

    def _has(self, file: str) -> bool:
        self._module("")
        return files(self.package).joinpath(file).is_file()


def catalogue() -> dict[str, CatalogueEntry]:
    """Return the devices there are, by name: those that ship, then those of installed packages."""
    folders = device_folders()
    return {folder.name: CatalogueEntry(folder.name, folder.package) for folder in folders if folder.problem is None}


def unusable_devices() -> list[str]:
    """Return one sentence for each installed device that cannot be used."""
    folders = device_folders()
    sentences = [folder.problem for folder in folders if folder.problem is not None]
    for entry in catalogue().values():
        try:
            _ = entry.capacity
            if not files(entry.package).joinpath(CAPACITY).is_file():
                sentences.append(f"device {entry.name}: {entry.package} has no {CAPACITY}")
        except (UnknownDevice, ValueError) as error:
            sentences.append(f"device {entry.name}: {error}")
    return sentences


def find_device(name: str) -> CatalogueEntry:
    """Return the device of that name.

    Raises
    ------
    UnknownDevice
        One sentence, with the names there are.
    """
    known = catalogue()
    try:
        return known[name]
    except KeyError:
        problems = [folder.problem for folder in device_folders() if folder.name == name and folder.problem]
        hint = f" ({problems[0]})" if problems else ""
        raise UnknownDevice(f"no device is called {name!r}; there are {', '.join(known)}{hint}") from None
