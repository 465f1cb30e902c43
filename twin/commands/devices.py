"""`twin devices`: what there is, and whether one of them answers."""

from __future__ import annotations

import argparse
import json
import textwrap

from devices.catalogue import CatalogueEntry, catalogue, unusable_devices
from devices.cia301.buses import available_buses
from devices.errors import UnknownDevice
from devices.faults.catalogue import FAULTS
from excitation import Capacity
from twin.commands.device_check import check

UNITS = {
    "stroke": ("mm", 1e3),
    "velocity": ("m/s", 1.0),
    "acceleration": ("m/s2", 1.0),
    "jerk": ("m/s3", 1.0),
    "frequency": ("Hz", 1.0),
    "payload": ("kg", 1.0),
}
"""Number of a capacity -> unit it is shown in, and how many of them make one SI unit."""
HEAD, WIDTH = 11, 109


def run(options: argparse.Namespace) -> int:
    """List, or check one; 0 done, 1 where an installed device cannot be used."""
    if options.action == "check":
        return check(options)
    problems = unusable_devices()
    machines = {name: entry for name, entry in catalogue().items() if _usable(entry)}
    buses = available_buses()
    if options.json:
        said = {
            "devices": {name: _data(entry) for name, entry in machines.items()},
            "buses": [bus._asdict() for bus in buses],
            "faults": {name: kind.line for name, kind in FAULTS.items()},
            "problems": problems,
        }
        print(json.dumps(said, indent=2, allow_nan=False))
    else:
        lines = [line for entry in machines.values() for line in _machine_lines(entry)]
        lines += [_line("bus", _bus_words(bus.interface, bus.channel, bus.note)) for bus in buses]
        names = textwrap.wrap(", ".join(FAULTS), WIDTH)
        lines += [_line(head, body) for head, body in zip(["faults", *[""] * len(names)], names, strict=False)]
        lines.append(_line("", "`twin run --fault list` says what each of them is; they act on emulators only"))
        lines += [_line("PROBLEM", problem) for problem in problems]
        print("\n".join(lines))
    return 1 if problems else 0


def _usable(entry: CatalogueEntry) -> bool:
    try:
        _ = entry.capacity
    except (UnknownDevice, ValueError):
        return False
    return True


def _line(head: str, body: str) -> str:
    return f"{head:<{HEAD}}{body}"


def _machine_lines(entry: CatalogueEntry) -> list[str]:
    has = ", ".join(_parts(entry)) or "capacity alone: it can be planned for"
    lines = [_line("device", f"{entry.name}: {entry.description}"), _line("", f"{has} ({entry.package})")]
    numbers = _numbers(entry.capacity)
    width = max(len(words) for words, _ in numbers.values())
    lines += [_line("", f"{words:<{width}}  [{source}]") for words, source in numbers.values()]
    return lines


def _parts(entry: CatalogueEntry) -> list[str]:
    drivers = [f"{name.replace('_', ' ')}: {what}" for name, what in entry.drivers.items()]
    return [*drivers, *(["emulator"] if entry.has_emulator else [])]


def _numbers(capacity: Capacity) -> dict[str, tuple[str, str]]:
    """Return each limit in words and where it comes from."""
    found: dict[str, tuple[str, str]] = {}
    for name, (unit, factor) in UNITS.items():
        value: float | None = getattr(capacity, name)
        if value is not None:
            words = f"{name} {value * factor:.6g} {unit}"
            found[name] = (words, capacity.provenance.get(name, "no source given"))
    if capacity.kinds is not None:
        found["kinds"] = (f"pulses {', '.join(capacity.kinds)}", capacity.provenance.get("kinds", "no source given"))
    if capacity.one_signed:
        found["one_signed"] = ("towards +x only", capacity.provenance.get("one_signed", "no source given"))
    return found if capacity.machine is None else {**found, **capacity.machine.described}


def _bus_words(interface: str, channel: str | None, note: str) -> str:
    place = f"--bus {interface}" if channel is None else f"--bus {interface} --channel {channel}"
    return f"{place}: {note}"


def _data(entry: CatalogueEntry) -> dict[str, object]:
    return {
        "description": entry.description,
        "package": entry.package,
        "drivers": entry.drivers,
        "emulator": entry.has_emulator,
        "capacity": entry.capacity.model_dump(mode="json"),
    }
