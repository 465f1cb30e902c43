"""Tables of outcomes: what is read, what is refused and in which line, and that no text breaks the parser."""

from __future__ import annotations

import math

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from excitation import CosineWave, SineWave
from twin.calibration.outcomes.trials import MOST_TRIALS, Trial, names_outcomes, read_trials
from twin.errors import InputError

HEADER = "kind,amplitude_g,frequency_hz,overturned\n"


def test_a_table_is_read() -> None:
    text = "\ufeff# our tests of May\n\nkind;amplitude_m_s2;frequency_hz;cycles;overturned;who\r\n"
    text += "sine;3.5;2;;YES;Ana\r\ncosine;-2.5;4.5;2.5;0;Ivo\r\n\n"
    trials = read_trials(text)
    assert trials == (Trial("sine", 3.5, 2.0, True), Trial("cosine", -2.5, 4.5, False, 2.5))
    assert trials[0].wave() == SineWave(3.5, 2.0)
    assert trials[1].wave() == CosineWave(-2.5, 4.5, 2.5)


def test_g_is_the_gravity_given() -> None:
    assert read_trials(HEADER + "sine,0.5,2,true", gravity=10.0)[0].amplitude == 5.0


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "the table of outcomes is empty"),
        (HEADER, "a header and no trials"),
        ("kind,amplitude_g,overturned\nsine,1,yes", "no column frequency_hz"),
        ("kind,frequency_hz,overturned\nsine,1,yes", "neither of amplitude_g and amplitude_m_s2"),
        ("kind,amplitude_g,amplitude_m_s2,frequency_hz,overturned\n", "both of amplitude_g"),
        ("kind,kind,amplitude_g,frequency_hz,overturned\n", "names the column kind twice"),
        (HEADER + "sine,1,2,yes\nsine,1,2\n", "line 3 has 3 fields; the header names 4 columns"),
        (HEADER + "# so\nsinus,1,2,yes", "line 3: kind is 'sinus'; did you mean sine?"),
        (HEADER + "sine,much,2,yes", "line 2: amplitude_g is 'much', which is no number"),
        (HEADER + "sine,nan,2,yes", "line 2: amplitude_g is 'nan'; it must be finite"),
        (HEADER + "sine,0,2,yes", "line 2: amplitude_g is '0'; it must not be 0"),
        (HEADER + "sine,1,-2,yes", "line 2: frequency_hz is '-2'"),
        (HEADER + "sine,1,2,perhaps", "line 2: overturned is 'perhaps'; it is yes or no"),
        ("kind,amplitude_g,frequency_hz,cycles,overturned\nsine,1,2,1000,no", "line 2: cycles is '1000'"),
        (HEADER + "sine,1,2,yes\n" * (MOST_TRIALS + 1), f"line {MOST_TRIALS + 2} is past the {MOST_TRIALS} trials"),
    ],
)
def test_a_bad_table_is_one_sentence(text: str, words: str) -> None:
    with pytest.raises(InputError) as refused:
        read_trials(text)
    assert words in str(refused.value)
    assert "\n" not in str(refused.value)


def test_a_table_of_outcomes_is_told_from_a_recording() -> None:
    assert names_outcomes("# c\n" + HEADER)
    assert names_outcomes("kind;amplitude_g;frequency_hz;overturned\n")
    assert not names_outcomes("time_s,rotation_rad\n0,0.1\n")
    assert not names_outcomes("")


words = st.text(max_size=8) | st.sampled_from(
    ["sine", "cosine", "yes", "no", "1e400", "-0", "inf", "1", "0.3", '"', ""]
)
lines = st.lists(st.lists(words, max_size=6).map(",".join), max_size=6).map("\n".join)


@settings(max_examples=60)
@given(st.text(max_size=100) | lines | lines.map(HEADER.__add__))
@example(HEADER + '"sine,1,2,yes')
@example(HEADER + "sine,1,2,yes\x00")
def test_no_text_breaks_the_parser(text: str) -> None:
    try:
        trials = read_trials(text)
    except InputError as error:
        trials, said = (), str(error)
    else:
        said = ""
    assert "\n" not in said
    for trial in trials:
        assert math.isfinite(trial.amplitude)
        assert trial.wave().duration > 0.0


@given(
    st.lists(
        st.tuples(
            st.sampled_from(["sine", "cosine"]),
            st.floats(1e-6, 1e3),
            st.floats(1e-3, 1e3),
            st.floats(1e-3, 100.0),
            st.booleans(),
        ),
        min_size=1,
        max_size=5,
    )
)
def test_what_is_written_is_read(rows: list[tuple[str, float, float, float, bool]]) -> None:
    text = "overturned,kind,cycles,amplitude_m_s2,frequency_hz\n" + "\n".join(
        f"{'yes' if fell else 'no'},{kind},{cycles!r},{amplitude!r},{frequency!r}"
        for kind, amplitude, frequency, cycles, fell in rows
    )
    assert read_trials(text) == tuple(Trial(k, a, f, fell, c) for k, a, f, c, fell in rows)
