"""Faults of machines that are released: nothing stops them on the way, they come to rest by themselves."""

from __future__ import annotations

import pytest

from devices.errors import FaultRefused
from devices.faults.catalogue import FAULTS, parse_fault
from devices.faults.injector import NEEDS_A_DRIVE
from tests.twin.fault_run import suffer
from twin.scene import Scene, load_scene

SCENES = {name: load_scene(name) for name in ("b6l_constant", "b6l_double_pulse")}
# No set-point is sent to them, and outputs that come a cycle late are the same ones.
BRIDGED = ("sync_late", "host_stall", "specimen_pushed", "setpoint_in_exchange", "frames_reordered")


def in_motion(scene: Scene) -> float:
    """When the base is on its way, s."""
    from devices.catalogue import find_device
    from twin.rehearsal import rehearse

    motion = rehearse(scene, find_device(scene.table.device).capacity).motion
    pulse = next(phase for phase in motion.phases if phase.name == "pulse")
    return round(0.5 * (pulse.start + pulse.end), 3)


@pytest.mark.parametrize("scene", SCENES)
@pytest.mark.parametrize("name", [name for name in FAULTS if name not in NEEDS_A_DRIVE])
def test_the_base_comes_to_rest_and_the_host_says_why(scene: str, name: str) -> None:
    run = suffer(SCENES[scene], parse_fault(f"{name}@{in_motion(SCENES[scene])}"))
    plant = run.emulator.plant
    if name != "emulator_killed":
        assert plant.at_rest
        assert plant.velocity == 0.0
        assert not run.emulator.release_device.armed
    if name == "host_killed":
        return
    assert run.story[0] == "fault"
    if name in BRIDGED:
        assert run.report.tripped is None
    else:
        assert run.story[1:] in (["trip", "stopped"], ["trip", "stop failed"])
        assert run.report.tripped


@pytest.mark.parametrize("scene", SCENES)
@pytest.mark.parametrize("name", NEEDS_A_DRIVE)
def test_a_machine_without_a_drive_refuses_a_drives_faults(scene: str, name: str) -> None:
    with pytest.raises(FaultRefused, match=f"fault {name} needs a servo drive; this machine has none"):
        suffer(SCENES[scene], parse_fault(f"{name}@1"))
