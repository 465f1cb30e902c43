"""`twin emulate`: table and specimen of a scene in a process of their own, for `twin run` in another one."""

from __future__ import annotations

import argparse
import json
import signal
import sys
import threading

from devices.errors import DeviceError
from devices.faults.fault import Fault
from devices.scheduling import real_time
from twin.commands.connection import LOCAL_BUSES, bus_of, emulate, emulated
from twin.commands.emulator_words import emulator_lines
from twin.commands.injection import injector_for, with_asked_faults
from twin.commands.inputs import capacity_for, emulator_numbers, scene_of
from twin.errors import InputError
from twin.rocking.track import warm_up
from twin.specimen import specimen_of


def run(options: argparse.Namespace) -> int:
    """Serve until Ctrl-C (or SIGTERM), then bring the table to rest."""
    scene = with_asked_faults(scene_of(options), options, "emulator")
    entry = emulated(scene)
    if options.bus == "virtual":
        raise InputError(f"--bus virtual ends at this process: use {LOCAL_BUSES[1]}, or `twin run` alone")
    warm_up()
    stop = threading.Event()

    def end(*_: object) -> None:
        stop.set()

    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, end)
    try:
        with bus_of(options) as bus:
            # The emulator holds the block until its drive is enabled: two cycles before the host's first.
            capacity = capacity_for(scene)
            specimen = specimen_of(scene, capacity, held=False)
            injector = injector_for(scene, None, "emulator")
            if injector is not None:
                injector.schedule.announce = _say
            for line in emulator_lines(emulator_numbers(scene), scene, capacity):
                print(line, file=sys.stderr)
            emulator = emulate(entry, bus, scene, capacity, specimen, injector=injector)
            # As the host's cycle is: a drive that answers late makes the host miss its cycles.
            with real_time() as scheduling:
                where = {"scene": scene.name, "device": entry.name, "bus": str(bus), "scheduling": scheduling}
                text = f"{entry.name} of {scene.name} on {bus}; {scheduling}; Ctrl-C ends it"
                print(json.dumps(where) if options.json else text, flush=True)
                emulator.serve(stop)
    except DeviceError as error:
        print(f"twin emulate: {error}", file=sys.stderr)
        return 2
    return 0


def _say(fault: Fault, moment: float) -> None:
    """Say what is injected here; the recording is the host's."""
    print(f"injected at {moment:.3f} s: {fault.name}: {fault.sentence}", file=sys.stderr, flush=True)
