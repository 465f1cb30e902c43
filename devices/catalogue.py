"""Devices by name, for the command line only; everything below it is handed values. Imports are lazy."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from typing import TYPE_CHECKING, Any, cast

from devices.errors import UnknownDevice

if TYPE_CHECKING:
    from devices.cia402.master import Cia402Table
    from devices.quanser_st3.emulator import EmulatedSt3
    from excitation import Capacity


@dataclass(frozen=True, slots=True)
class CatalogueEntry:
    """One device: its folder in this package, and what that folder holds."""

    name: str
    description: str
    has_driver: bool
    has_emulator: bool

    @property
    def capacity(self) -> Capacity:
        """The folder's `CAPACITY`."""
        return cast("Capacity", self._attribute("capacity", "CAPACITY"))

    @property
    def open_table(self) -> Callable[..., Cia402Table]:
        """The folder's `driver.open_table`; UnknownDevice where there is no driver."""
        if not self.has_driver:
            raise UnknownDevice(f"{self.name} has no driver yet; it can only be planned for")
        return cast("Callable[..., Cia402Table]", self._attribute("driver", "open_table"))

    @property
    def emulator(self) -> type[EmulatedSt3]:
        """The folder's emulator; UnknownDevice where there is none."""
        if not self.has_emulator:
            raise UnknownDevice(f"{self.name} has no emulator yet; it can only be planned for")
        return cast("type[EmulatedSt3]", self._attribute("emulator", "EmulatedSt3"))

    def _attribute(self, module: str, name: str) -> Any:
        return getattr(import_module(f"devices.{self.name}.{module}"), name)


_ENTRIES = (
    CatalogueEntry("quanser_st3", "Quanser Shake Table III XY, one axis, over CiA 402", True, True),
    CatalogueEntry("air_track", "air track with a cart drawn by a falling mass", False, False),
)
DEVICES = {entry.name: entry for entry in _ENTRIES}


def find_device(name: str) -> CatalogueEntry:
    """Return the device of that name.

    Raises
    ------
    UnknownDevice
        One sentence, with the names there are.
    """
    try:
        return DEVICES[name]
    except KeyError:
        raise UnknownDevice(f"no device is called {name!r}; there are {', '.join(DEVICES)}") from None
