"""What a table can do, as a value."""

from __future__ import annotations

import math

import pytest
from pydantic import ValidationError

from excitation import Capacity, ConstantPulse, DoublePulse, SineWave

NUMBERS = {"stroke": 0.2, "velocity": 0.6, "acceleration": 9.81}


def test_a_capacity_is_an_immutable_value() -> None:
    capacity = Capacity(name="table", **NUMBERS, provenance={"stroke": "data sheet"})
    assert capacity == Capacity(name="table", **NUMBERS, provenance={"stroke": "data sheet"})
    assert hash(capacity) == hash(Capacity(name="table", **NUMBERS))
    assert Capacity.model_validate_json(capacity.model_dump_json()) == capacity
    with pytest.raises(ValidationError):
        capacity.stroke = 1.0  # type: ignore[misc]


def test_kinds_are_families_or_kinds() -> None:
    sine, constant, double = SineWave(1.0, 1.0), ConstantPulse(1.0, 1.0), DoublePulse(0.1, 0.02)
    assert Capacity(name="any", **NUMBERS).makes(sine)
    some = Capacity(name="some", **NUMBERS, kinds=["constant", "double_pulse"])  # type: ignore[arg-type]
    assert [some.makes(pulse) for pulse in (sine, constant, double)] == [False, True, True]
    assert Capacity.model_validate_json(some.model_dump_json()) == some
    one = Capacity(name="one", **NUMBERS, kinds=("single sine",))
    assert [one.makes(pulse) for pulse in (sine, SineWave(1.0, 1.0, 2))] == [True, False]


@pytest.mark.parametrize("field", ["stroke", "velocity", "acceleration", "jerk", "frequency", "payload"])
@pytest.mark.parametrize("bad", [0.0, -1, math.nan, math.inf, "1", True])
def test_numbers_are_finite_and_above_zero(field: str, bad: object) -> None:
    with pytest.raises(ValidationError) as caught:
        Capacity(name="table", **{**NUMBERS, field: bad})  # type: ignore[arg-type]
    (error,) = caught.value.errors()
    assert error["loc"] == (field,)
    assert error["msg"].startswith(f"{field} ")


@pytest.mark.parametrize(
    "more", [{"name": ""}, {"kinds": ()}, {"kinds": "constant"}, {"kinds": (1,)}, {"stroke_mm": 216}, {"one_signed": 1}]
)
def test_malformed_capacities_are_refused(more: dict[str, object]) -> None:
    with pytest.raises(ValidationError):
        Capacity(**{"name": "table", **NUMBERS, **more})  # type: ignore[arg-type]


def test_provenance_names_numbers() -> None:
    with pytest.raises(ValidationError) as caught:
        Capacity(name="table", **NUMBERS, provenance={"strok": "data sheet"})
    assert [e["msg"] for e in caught.value.errors()] == ["provenance names 'strok', which is no number of a capacity"]
