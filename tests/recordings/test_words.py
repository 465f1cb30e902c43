"""A recording in words, as a person reads it in the viewer."""

from __future__ import annotations

from recordings import read_run
from recordings.samples import sample_path
from recordings.words import LONGEST_VALUE, about_text, clip_text, document_text


def test_metadata_as_text() -> None:
    text = document_text({"scene": {"name": "b6l", "toml": "[block]\nwidth_mm = 60\n"}})
    assert text == (
        "## scene\n\n| key | value |\n|---|---|\n| name | b6l |\n\ntoml:\n\n```\n[block]\nwidth_mm = 60\n```\n"
    )


def test_a_table_is_not_broken_by_what_stands_in_it() -> None:
    text = document_text({"notes": {"text": "a | b", "long": "x" * 1000}})
    assert "| text | a \\| b |" in text
    assert "x" * LONGEST_VALUE + " ... (1000 characters" in text
    assert max(map(len, text.splitlines())) < LONGEST_VALUE + 80


def test_a_sample_says_what_it_is() -> None:
    run = read_run(sample_path("sine"))
    text = about_text(run.metadata, ["it ends early"])
    head = text[: text.index("## ")]
    assert head.startswith("# B6L under one full sine")
    for line in (
        "| scene | sine |",
        "| block | 60 x 270 mm, 2.5692 kg, restitution of Housner |",
        "| asked | single sine: 3.139 m/s2",
        "| given | as asked |",
        "| outcome | predicted rocked; measured rocked |",
        "| recorded | 2026-01-01 00:00:00 UTC |",
        "| damaged | it ends early |",
    ):
        assert line in head, line


def test_the_clip_report_names_the_provenance_of_each_number() -> None:
    text = clip_text(read_run(sample_path("fall")).metadata)
    assert "asked      single sine" in text
    assert "| stroke | 0.216 | recalled placeholder" in text


def test_a_run_without_metadata_has_words_too() -> None:
    assert about_text({}).startswith("# A run")
    assert "nothing shook" in clip_text({})
    strange = {"scene": {"json": "[1, 2"}, "clock": {"origin_ns": "9" * 40}}
    assert "# A run" in about_text(strange)
