"""The stack as a value, and the names of its configurations."""

from __future__ import annotations

import pytest
from pydantic import ValidationError

from tests.facts import B6L
from twin import Block, Stack
from twin.stack.configuration import TWO_BLOCKS, configuration_name, configuration_signs


def test_contacts_and_masses() -> None:
    stack = Stack([Block(0.1, 0.2), Block(0.06, 0.27), Block(0.08, 0.1)])
    assert stack.half_contacts == (0.05, 0.03, 0.03)
    assert stack.masses == pytest.approx((0.02, 0.0162, 0.008))
    assert stack.height == pytest.approx(0.57)
    assert len(stack) == 3


def test_a_part_is_a_block() -> None:
    part = Stack([B6L]).part(0)
    assert part.slenderness == pytest.approx(B6L.slenderness, rel=1e-15)
    assert part.frequency_parameter == pytest.approx(B6L.frequency_parameter, rel=1e-15)
    assert part.uplift_acceleration == pytest.approx(B6L.uplift_acceleration, rel=1e-15)
    pair = Stack([Block(0.06, 0.1), Block(0.06, 0.17)]).part(0)
    assert pair.frequency_parameter == pytest.approx(B6L.frequency_parameter, rel=1e-14)


def test_which_interface_lifts_first() -> None:
    assert Stack([B6L, B6L]).first_to_lift == 0
    assert Stack([Block(0.2, 0.1), Block(0.06, 0.27)]).first_to_lift == 1


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (([],), "at least 1 item"),
        (([B6L] * 9,), "at most 8 items"),
        (([B6L, Block(0.06, 0.27)],), "1 of 2 blocks have a mass; a stack needs all or none"),
        (
            ([Block(1, 2), Block(1, 2, gravity=1.62)],),
            "blocks of a stack must share one gravity; given are 1.62 and 9.81",
        ),
        (([B6L, B6L], [1.0]), "1 impulse shares are given for 2 interfaces"),
        (([B6L], [1.5]), "impulse share is 1.5; it is a share of the half width, 0 to 1"),
        (([B6L], [float("nan")]), "finite number"),
        (([0.06],), "Block"),
    ],
)
def test_refusals(arguments: tuple[object, ...], sentence: str) -> None:
    with pytest.raises(ValidationError, match=sentence):
        Stack(*arguments)  # type: ignore[arg-type]


def test_names() -> None:
    for name, signs in TWO_BLOCKS.items():
        assert configuration_name(signs) == name
        assert configuration_signs(name, 2) == signs
    assert configuration_signs("+0-", 3) == (1, 0, -1)
    assert configuration_name((1, 0, -1)) == "+0-"
    assert configuration_signs("rest", 3) == (0, 0, 0)
    for name, blocks in (("5a", 2), ("++", 3), ("1a", 3), ("", 1)):
        with pytest.raises(ValueError, match="is no configuration"):
            configuration_signs(name, blocks)
