"""Measured accelerograms: exact integration, AT2 and CSV texts, and everything that is not one."""

from __future__ import annotations

import math
import pickle
from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from pydantic import ValidationError
from scipy.integrate import cumulative_trapezoid

from excitation import Pulse, Record
from excitation.accelerogram import MAX_SAMPLES

KOBE = Path(__file__).parents[2].parent / "shared" / "data" / "kobe1995_nishi_akashi_090.at2"

COUNT_FIRST = "4096    0.0100    NPTS, DT"
NAME_FIRST = "NPTS=  4096, DT=   .0100 SEC"


def at2(
    values: str, line: str = "NPTS=  4, DT=   .0100 SEC", units: str = "ACCELERATION TIME SERIES IN UNITS OF G"
) -> str:
    return f"PEER NGA STRONG MOTION DATABASE RECORD\nSomewhere, 1/1/2000, Station, 090\n{units}\n{line}\n{values}\n"


FOUR = " .1000000E+00 -.2000000E+00\n 0.300000D+00   4.0E-1"


def csv(times: list[float], header: str = "time_s,acceleration_m_s2") -> str:
    return "\n".join([header, *(f"{t!r},{0.5 * i!r}" for i, t in enumerate(times))])


def refusal(call: object, *args: object) -> str:
    """The one sentence with which a call refuses its arguments."""
    with pytest.raises(ValueError, match=r".") as caught:
        call(*args)  # type: ignore[operator]
    sentence = str(caught.value)
    assert "\n" not in sentence
    assert len(sentence) < 300
    return sentence


@given(st.lists(st.floats(-20.0, 20.0), min_size=2, max_size=40), st.floats(1e-4, 1.0))
def test_a_record_is_linear_between_samples_and_integrated_exactly(samples: list[float], dt: float) -> None:
    record = Record(samples, dt)
    t = np.arange(len(samples)) * dt
    assert record.duration == t[-1]
    assert np.array_equal(record.acceleration(t[:-1]), samples[:-1])
    middle = 0.5 * (t[1:] + t[:-1])
    assert record.acceleration(middle) == pytest.approx(0.5 * (np.array(samples)[1:] + samples[:-1]), abs=1e-9)
    # The trapezoidal rule is exact for v; x is cubic: Simpson's rule on v with the middles is exact for it.
    v = cumulative_trapezoid(samples, t, initial=0.0)
    assert record.velocity(t) == pytest.approx(v, rel=1e-12, abs=1e-11)
    simpson = dt / 6.0 * (v[:-1] + 4.0 * record.velocity(middle) + v[1:])
    assert record.displacement(t) == pytest.approx(np.append(0.0, np.cumsum(simpson)), rel=1e-11, abs=1e-10)


def test_a_record_keeps_its_own_read_only_samples() -> None:
    own = np.array([0.0, 1.0, 0.0])
    record = Record(own, 0.1, "test")
    own[1] = 5.0
    assert record.samples.tolist() == [0.0, 1.0, 0.0]
    for each in (record, pickle.loads(pickle.dumps(record))):  # noqa: S301
        with pytest.raises(ValueError, match="read-only"):
            each.samples[0] = 1.0
    assert record == Record((0, 1, 0), 0.1, "test")
    assert record != Record([0, 1, 0], 0.2, "test")
    assert record != "test"
    assert record.scaled(-2.0) == Record([0.0, -2.0, 0.0], 0.1, "test")
    assert "name='test'" in repr(record)
    assert "1." not in repr(record).replace("0.1", "")


@pytest.mark.parametrize(
    ("samples", "message"),
    [
        ([1.0], "1 samples"),
        ([], "0 samples"),
        ([[0.0, 1.0]], "shape"),
        ([[0.0, 1.0], [1.0]], "one row"),
        (["a", "b"], "must be numbers"),
        ([True, False], "must be numbers"),
        (None, "must be numbers"),
        ([0.0, math.nan], "sample 1 is nan"),
        ([math.inf, 0.0], "sample 0 is inf"),
        ([0.0, 1e7], "at most"),
        (np.zeros(MAX_SAMPLES + 1), "500001 samples"),
    ],
)
def test_samples_that_are_none_are_refused(samples: object, message: str) -> None:
    with pytest.raises(ValidationError, match=message):
        Record(samples, 0.1)  # type: ignore[arg-type]


@pytest.mark.skipif(not KOBE.exists(), reason="the third-party record stays outside the repository")
def test_the_real_record() -> None:
    text = KOBE.read_text(encoding="ascii")
    record = Record.from_at2(text)
    raw = np.array(" ".join(text.splitlines()[4:]).split(), dtype=float)
    assert record.name == "KOBE 01/16/95 2046, NISHI-AKASHI, 090 (CUE)"
    assert len(record.samples) == 4096
    assert record.duration == pytest.approx(40.95)
    assert record.samples == pytest.approx(raw * 9.81, rel=1e-15)
    assert record.peak_acceleration == pytest.approx(9.81 * np.abs(raw).max(), rel=1e-15)
    t = np.arange(4096) * 0.01
    v = cumulative_trapezoid(raw * 9.81, t, initial=0.0)
    assert record.peak_velocity == pytest.approx(np.abs(v).max(), rel=1e-3)
    assert record.velocity(t) == pytest.approx(v, rel=1e-12, abs=1e-13)
    assert Record.from_at2(text, scale=0.5, gravity=10.0).samples == pytest.approx(raw * 5.0, rel=1e-15)
    assert "declares 4096 samples, holds 4090" in refusal(Record.from_at2, "\n".join(text.splitlines()[:-2]))


@pytest.mark.parametrize(
    "line",
    [
        "4    0.0100    NPTS, DT",
        "   4  .01  NPTS, DT",
        "4 0.0100 npts,dt",
        "NPTS=  4, DT=   .0100 SEC",
        "NPTS=4,DT=1.0D-02",
        "  NPTS =  4 , DT = 0.01 SEC,  ",
        "NPTS= 4 DT= .01",
    ],
)
def test_the_variants_of_at2(line: str) -> None:
    for text in (at2(FOUR, line), at2(FOUR, line).replace("\n", "\r\n"), "\ufeff" + at2(FOUR, line) + "\x1a"):
        record = Record.from_at2(text, gravity=10.0)
        assert record.samples == pytest.approx([1.0, -2.0, 3.0, 4.0], rel=1e-15)
        assert record.time_step == 0.01
        assert record.name == "Somewhere, 1/1/2000, Station, 090"


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("", "the AT2 text ends after 1 of its 4 header lines"),
        (at2("1 2 3"), "the AT2 text declares 4 samples, holds 3"),
        (at2("1 2 3 4 5"), "the AT2 text declares 4 samples, holds 5"),
        (at2("1", NAME_FIRST), "the AT2 text declares 4096 samples, holds 1"),
        (at2("1", COUNT_FIRST), "the AT2 text declares 4096 samples, holds 1"),
        (at2("1", "NPTS= 999999999, DT= .01 SEC"), "the AT2 text declares 999999999 samples, holds 1"),
        (at2("1", "NPTS= 99999999999, DT= .01 SEC"), "line 4 of the AT2 text does not state NPTS and DT"),
        (at2("1", "NPTS= 1, DT= .01.1 SEC"), "line 4 of the AT2 text does not state NPTS and DT"),
        (at2("1", "NPTS= 1, DT= .00 SEC"), "line 4 of the AT2 text states a step of 0 s; it must be above 0 s"),
        (at2("1", "NPTS= 1, DT= .01 SEC"), "a record has 1 samples; it must have 2 to 500000"),
        (at2(FOUR, units="ACCELERATION"), "line 3 of the AT2 text does not state its units; it must say UNITS OF G"),
        (
            at2(FOUR, units="VELOCITY TIME SERIES IN UNITS OF CM/S"),
            "line 3 of the AT2 text states units of 'CM/S'; it must say UNITS OF G",
        ),
        (
            at2("-.1E-01-.2E-02 3 4 5"),
            "line 5 of the AT2 text has '-.1E-01-.2E-02', which is not one finite number",
        ),
        (at2("1 2\n3 NaN"), "line 6 of the AT2 text has 'NaN', which is not one finite number"),
        (at2("1 2 3 1E999"), "line 5 of the AT2 text has '1E999', which is too large a number"),
        (at2("1 2 3 ********"), "line 5 of the AT2 text has '********', which is not one finite number"),
        (at2("1 2 3 1e8"), "sample 3 is 9.81e+08 m/s2; samples must be finite and at most 1e+06 m/s2"),
        ("\n" * 3 + " " * 5000 + "x", "an AT2 header line has at most 1000 characters; this is no AT2 text"),
    ],
)
def test_broken_at2_is_refused_in_one_sentence(text: str, sentence: str) -> None:
    assert refusal(Record.from_at2, text) == sentence


@pytest.mark.parametrize("bad", [math.nan, math.inf, "2", True])
def test_scale_and_gravity_are_checked(bad: object) -> None:
    assert "scale" in refusal(Record.from_at2, at2(FOUR), bad)
    assert "gravity" in refusal(Record.from_at2, at2(FOUR), 1.0, bad)
    assert "gravity is 0 m/s2" in refusal(Record.from_csv, "time_s,acceleration_g\n0,0\n1,0", 1.0, 0)


def test_the_variants_of_csv() -> None:
    plain = Record.from_csv("time_s,acceleration_m_s2\n0,1\n0.1,2\n0.2,-3\n")
    assert plain.samples.tolist() == [1.0, 2.0, -3.0]
    assert plain.time_step == pytest.approx(0.1, rel=1e-15)
    semicolons = '# made up\n\n"acceleration_m_s2" ; note; time_s\r\n1;a;5.0\r\n# gap\r\n2;b;5.1\r\n-3;c;5.2'
    assert Record.from_csv(semicolons).samples.tolist() == [1.0, 2.0, -3.0]
    in_g = Record.from_csv("time_s,acceleration_g\n0,.1\n1E-1,.2\n2D-1,-.3", scale=2.0, gravity=10.0)
    assert in_g.samples == pytest.approx([2.0, 4.0, -6.0], rel=1e-15)
    assert Record.from_csv(csv([0.0, 0.01, 0.020001, 0.03])).duration == pytest.approx(0.03, rel=1e-15)


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("", "the CSV text holds neither a header nor samples"),
        ("# nothing", "the CSV text holds neither a header nor samples"),
        ("0,1\n1,2", "the header of the CSV text names no column time_s"),
        ("time_s,a\n1,2", "the header of the CSV text names no column acceleration_m_s2 or acceleration_g"),
        (
            "time_s,acceleration_m_s2,acceleration_g\n1,2,3",
            "the header of the CSV text names more than one column acceleration_m_s2 or acceleration_g",
        ),
        ("time_s,time_s,acceleration_g\n", "the header of the CSV text names more than one column time_s"),
        (csv([0.0]), "the CSV text holds 1 samples; a record needs at least 2"),
        ("time_s,acceleration_g\n0,1\n1", "line 3 of the CSV text has 1 fields; its header names 2 columns"),
        ("time_s,acceleration_g\n0,1\n1,x", "line 3 of the CSV text has 'x', which is not one finite number"),
        ("time_s,acceleration_g\n0,1\n1,", "line 3 of the CSV text has '', which is not one finite number"),
        ("time_s,acceleration_g\n0,1\n1,inf", "line 3 of the CSV text has 'inf', which is not one finite number"),
        (
            csv([0.0, 0.1, 0.2, 0.4, 0.5]),
            "a sample is missing from the CSV text between 0.2 s and 0.4 s (line 5); its step is 0.1 s",
        ),
        (
            csv([0.0, 0.1, 0.2, 0.5, 0.6, 0.7]),
            "2 samples are missing from the CSV text between 0.2 s and 0.5 s (line 5); its step is 0.1 s",
        ),
        (
            csv([0.0, 0.1, 0.2, 0.33, 0.43]),
            "the time step of the CSV text changes between 0.2 s and 0.33 s (line 5) from 0.1 s to 0.13 s",
        ),
        (
            csv([0.0, 0.1, 0.2, 0.1, 0.2, 0.3]),
            "the time step of the CSV text changes between 0.2 s and 0.1 s (line 5) from 0.1 s to -0.1 s",
        ),
        (csv([0.3, 0.2, 0.1]), "the times of the CSV text do not increase: the median step is -0.1 s"),
        (csv([-1.7e308, 1.7e308]), "the times of the CSV text do not increase: the median step is inf s"),
    ],
)
def test_broken_csv_is_refused_in_one_sentence(text: str, sentence: str) -> None:
    assert refusal(Record.from_csv, text) == sentence


def test_too_long_or_no_text_is_refused() -> None:
    assert "limit" in refusal(Record.from_at2, "0 " * (33 * MAX_SAMPLES))
    assert refusal(Record.from_csv, b"time_s") == "the CSV text must be text, not bytes"


WORDS = ["time_s", "acceleration_g", "NPTS=", "1E400", "0", "1", ".1", "-", "D", "E", "nan", "#", ",", ";"]
STRANGE = ["\n", "\r", " ", '"', "9" * 30, "\x00", "\ufeff", "\x1a", "\u0663", "\x85", "\ud800", "UNITS OF G"]
FRAGMENTS = st.sampled_from([*at2(FOUR).split("\n"), COUNT_FIRST, *WORDS, *STRANGE])
TEXTS = st.one_of(
    st.text(max_size=200),
    st.lists(FRAGMENTS, max_size=40).map("".join),
    st.lists(FRAGMENTS, max_size=12).map("\n".join),
    st.lists(FRAGMENTS, max_size=10).map(lambda rest: at2(" ".join(rest))),
    st.lists(FRAGMENTS, max_size=10).map(lambda rest: "time_s,acceleration_g\n0,0\n1,1\n" + "".join(rest)),
    st.binary(max_size=200).map(lambda garbage: garbage.decode("latin-1")),
    st.tuples(st.integers(0, 150), st.characters()).map(lambda cut: at2(FOUR)[: cut[0]] + cut[1] + at2(FOUR)[cut[0] :]),
)


@given(TEXTS)
@example("\x00" * 100)
@settings(max_examples=300)
def test_any_text_gives_a_record_or_one_sentence(text: str) -> None:
    for parse in (Record.from_at2, Record.from_csv):
        try:
            record: Pulse = parse(text)
        except ValueError as error:
            assert "\n" not in str(error)  # noqa: PT017
            assert len(str(error)) < 300  # noqa: PT017
        else:
            assert math.isfinite(record.peak_acceleration)
            assert math.isfinite(record.travel)
