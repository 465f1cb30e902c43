"""Where device folders are found: in this package, and in packages that were installed for it. Nowhere else.

A package offers a device with an entry point of the group `shake_table_twin.devices`: the device's name, and the
package that holds its folder. What moves a table must not depend on the folder a command happens to be started in, so
metadata and code of such a package must lie where packages are installed; an editable install is one.
"""

from __future__ import annotations

import json
import site
import sysconfig
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from importlib.machinery import ModuleSpec
from importlib.metadata import Distribution, EntryPoint, distributions
from importlib.util import find_spec
from pathlib import Path
from pkgutil import iter_modules
from urllib.parse import unquote, urlsplit
from urllib.request import url2pathname

import devices

GROUP = "shake_table_twin.devices"
CAPACITY = "capacity.toml"
"""The file that makes a folder a device's."""


@dataclass(frozen=True, slots=True)
class DeviceFolder:
    """A device's name and the package that holds its folder; `problem` says why it cannot be used."""

    name: str
    package: str
    problem: str | None = None


def device_folders(places: Iterable[Path] | None = None) -> list[DeviceFolder]:
    """Return the devices of this package, then those of installed ones, by name.

    Parameters
    ----------
    places : iterable of Path, optional
        Folders in which packages are installed; those of this interpreter unless told.
    """
    found = _shipped()
    names = {folder.name for folder in found}
    others = sorted(_offered(site_folders() if places is None else places), key=lambda folder: folder.name)
    for folder in others:
        if folder.name in names:
            problem = f"device {folder.name} of package {folder.package}: there is another one of that name"
            folder = DeviceFolder(folder.name, folder.package, problem)
        names.add(folder.name)
        found.append(folder)
    return found


def site_folders() -> list[Path]:
    """Return the folders in which this interpreter's packages are installed."""
    folders = [sysconfig.get_path("purelib"), sysconfig.get_path("platlib"), *site.getsitepackages()]
    if site.ENABLE_USER_SITE:
        folders.append(site.getusersitepackages())
    return list(dict.fromkeys(Path(folder).resolve() for folder in folders))


def _shipped() -> list[DeviceFolder]:
    folders: list[DeviceFolder] = []
    for home in map(Path, devices.__path__):
        for module in iter_modules([str(home)]):
            if module.ispkg and (home / module.name / CAPACITY).is_file():
                folders.append(DeviceFolder(module.name, f"{devices.__name__}.{module.name}"))
    return folders


def _offered(places: Iterable[Path]) -> Iterator[DeviceFolder]:
    # One place at a time: what is not told otherwise looks in sys.path, and that may begin with the current folder.
    for place in places:
        for distribution in distributions(path=[str(place)]):
            for point in distribution.entry_points.select(group=GROUP):
                yield DeviceFolder(point.name, point.value, _problem(point, _homes(distribution, place)))


def _homes(distribution: Distribution, place: Path) -> list[Path]:
    """Return where the distribution's code may lie: beside its metadata, or where its editable install says."""
    homes = [place.resolve()]
    try:
        origin = json.loads(distribution.read_text("direct_url.json") or "{}")
        if origin.get("dir_info", {}).get("editable"):
            homes.append(Path(url2pathname(unquote(urlsplit(str(origin["url"])).path))).resolve())
    except (ValueError, KeyError, AttributeError):
        pass
    return homes


def _problem(point: EntryPoint, homes: list[Path]) -> str | None:
    """Return why the package is not to be imported; nothing of it is run here."""
    where = f"device {point.name} of package {point.value}"
    top = point.value.partition(".")[0]
    if not all(part.isidentifier() for part in point.value.split(".")) or not point.name.isidentifier():
        return f"{where}: name and package must be plain names"
    try:
        spec = find_spec(top)
    except (ImportError, ValueError):
        spec = None
    if spec is None:
        return f"{where}: there is no package {top}"
    for location in _locations(spec):
        if not any(location.is_relative_to(home) for home in homes):
            return f"{where}: it would be loaded from {location}, which is not where it is installed"
    return None


def _locations(spec: ModuleSpec) -> list[Path]:
    found = list(spec.submodule_search_locations or ())
    return [Path(place).resolve() for place in (found or [spec.origin or ""])]
