"""A goal in words: forgiving in how it is said, never misunderstood."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from twin.errors import InputError
from twin.search.goals import Aim, Goal, known_goals, read_goal


@pytest.mark.parametrize(
    ("words", "aim"),
    [
        ("overturn without impact", Aim.NO_IMPACT),
        ("Overturn, no impacts!", Aim.NO_IMPACT),
        ("a run that overturns the block without any impact", Aim.NO_IMPACT),
        ("without impact overturn", Aim.NO_IMPACT),
        ("overturn", Aim.OVERTURN),
        ("topple", Aim.OVERTURN),
        ("largest safe amplitude", Aim.SAFE),
        ("the Largest_Safe-Amplitude at this frequency", Aim.SAFE),
        ("max safe amplitude", Aim.SAFE),
        ("rock without overturning", Aim.ROCK),
        ("largest rocking without overturning", Aim.ROCK),
        ("separate restitution", Aim.SEPARATE),
        ("a run that separates Housner's from a measured restitution best", Aim.SEPARATE),
    ],
)
def test_what_is_meant(words: str, aim: Aim) -> None:
    assert read_goal(words).aim is aim


@pytest.mark.parametrize("aim", Aim)
def test_every_goal_is_known_by_its_own_name(aim: Aim) -> None:
    assert read_goal(aim.value) == Goal(aim)
    assert aim.value in known_goals()


def test_the_numbers_in_the_words() -> None:
    assert read_goal("largest safe amplitude at 3.2 Hz with probability below 2.5 %") == Goal(Aim.SAFE, 0.025, 3.2)
    assert read_goal("overturn at 2Hz").at == 2.0


@pytest.mark.parametrize(
    "words",
    [
        "",
        "safe",
        "do not overturn",
        "without overturning",
        "does not overturn without impact",
        "impact without overturning",
        "overturn without rocking",
        "overturn after 1 impact",
        "overturn or rock",
        "smallest safe amplitude",
        "largest safe frequency",
        "largest safe amplitude below 0.3",
        "largest safe amplitude above 1 %",
        "overturn without an impact below 1 %",
        "largest safe amplitude below 0 %",
        "largest safe amplitude below 99 %",
        "largest safe amplitude at -3 Hz",
        "overturn at 2 Hz and at 3 Hz",
        "umkippen",
    ],
)
def test_what_is_not_understood_is_said_in_one_sentence(words: str) -> None:
    with pytest.raises(InputError, match="--find") as refused:
        read_goal(words)
    assert "\n" not in str(refused.value)


def test_an_unknown_goal_lists_the_goals() -> None:
    with pytest.raises(InputError, match=r"overturn without impact.*largest safe amplitude.*separate restitution"):
        read_goal("find me the best")


@given(
    st.text(max_size=80)
    | st.lists(st.sampled_from(["overturn", "without", "impact", "safe", "not", "3", "Hz", "%", "rock"])).map(" ".join)
)
def test_any_text_is_a_goal_or_a_sentence(text: str) -> None:
    try:
        goal = read_goal(text)
    except InputError:
        return
    assert goal.aim in Aim
    assert 0.0 < goal.limit <= 0.5
