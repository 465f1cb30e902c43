"""What `twin plan` says of the model and of the contact, in words and as data."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest

from twin import Block, simulate
from twin.commands.inputs import capacity_for
from twin.errors import InputError
from twin.plan import Plan, plan_run
from twin.plan_data import as_data
from twin.plan_report import sentences
from twin.scene import parse_scene

SCENE = """
[block]
width_mm = 60
height_mm = 270
mass_kg = 2.5692
{block}
[excitation]
{excitation}
[table]
device = "quanser_st3"
[twin]
futures = 1
"""
SINE = 'kind = "sine"\namplitude_g = 0.3\nfrequency_hz = 4'
QUIET = 'kind = "sine"\namplitude_g = 0.2\nfrequency_hz = 4'
STILL = 'kind = "none"'


def plan(excitation: str, block: str = "") -> Plan:
    scene = parse_scene(SCENE.format(excitation=excitation, block=block), name="mine", folder=Path())
    return plan_run(scene, capacity_for(scene))


def lines(given: Plan, label: str) -> list[str]:
    return [line for line in sentences(given) if line.startswith(label)]


def test_the_contact_is_reported() -> None:
    given = plan(SINE)
    assert given.contact is not None
    assert given.contact.holds
    (line,) = lines(given, "contact")
    assert f"needs friction {given.contact.friction_needed:.3f}" in line
    assert "0.165 at each impact" in line
    assert "the scene gives no friction" in line
    newtons = given.contact.least_normal * 2.5692 * 9.81
    assert f"least normal force {newtons:.4g} N" in line
    assert not lines(given, "WARNING")
    data = json.loads(json.dumps(as_data(given), allow_nan=False))
    assert data["contact"]["friction_needed"] == given.contact.friction_needed
    assert data["contact"]["holds"] is True
    assert data["contact"]["sliding_time_s"] is None


def test_too_little_friction_is_a_warning_with_its_time() -> None:
    given = plan(SINE, "friction = 0.23")
    assert given.contact is not None
    assert given.contact.sliding_time is not None
    (line,) = lines(given, "WARNING")
    assert f"friction 0.23 is not enough from {given.contact.sliding_time:.3f} s on" in line
    assert "the scene has 0.23" in lines(given, "contact")[0]
    enough = plan(SINE, "friction = 0.3")
    assert not lines(enough, "WARNING")
    contact = as_data(given)["contact"]
    assert isinstance(contact, dict)
    assert contact["sliding_time_s"] == given.contact.sliding_time


def test_a_base_that_would_have_to_pull_is_a_warning() -> None:
    """No table here throws the block: the contact is that of one pushed off at 1.6 p."""
    block = Block(0.06, 0.27, mass=2.5692)
    thrown = simulate(block, initial_angular_velocity=1.6 * block.frequency_parameter).validity(friction=0.5)
    given = replace(plan(STILL), contact=thrown)
    (pull, slide) = lines(given, "WARNING")
    assert "the base would have to pull at 0.000 s" in pull
    assert "friction 0.5 is not enough from 0.000 s on" in slide
    assert "no friction would do" in lines(given, "contact")[0]
    data = json.loads(json.dumps(as_data(given), allow_nan=False))
    assert data["contact"]["friction_needed"] is None
    assert data["contact"]["lift_off_time_s"] == 0.0


def test_a_block_let_go_beyond_its_corner_is_not_judged() -> None:
    """It falls at once: what the base does to it from then on changes nothing."""
    given = plan(STILL, "initial_rotation_deg = 85")
    assert given.contact is not None
    assert given.contact.until == 0.0
    assert given.contact.holds


def test_a_double_pulse_at_its_limit_is_planned() -> None:
    """The gap leaves no room for more speed: the margin is looked for downwards only."""
    given = plan('kind = "double_pulse"\npeak_velocity_m_s = 0.6\nstop_gap_mm = 2')
    assert given.margin is not None
    assert given.margin.up is None
    assert given.contact is not None


@pytest.mark.parametrize(
    ("excitation", "block", "model"),
    [(SINE, "", "nonlinear"), (QUIET, "", "at rest"), (STILL, "initial_rotation_deg = 5", "linearised")],
)
def test_the_model_is_reported(excitation: str, block: str, model: str) -> None:
    given = plan(excitation, block)
    assert given.response is not None
    assert given.response.model == "nonlinear"
    (line,) = lines(given, "model")
    assert line.startswith("model      nonlinear")
    if model != "nonlinear":
        assert f"enough would be {model}: " in line
    sufficient = as_data(given)["sufficient_model"]
    assert isinstance(sufficient, dict)
    assert sufficient["model"] == model
    prediction = as_data(given)["prediction"]
    assert isinstance(prediction, dict)
    assert prediction["model"] == "nonlinear"


@pytest.mark.parametrize("friction", ["0", "-0.1", "nan", "'rough'"])
def test_friction_is_checked(friction: str) -> None:
    with pytest.raises(InputError, match="friction"):
        plan(SINE, f"friction = {friction}")
