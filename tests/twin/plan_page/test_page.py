"""The printed page: what stands on it, that nothing runs over its edge, and that nobody's text can break it."""

from __future__ import annotations

import re
import zlib
from collections.abc import Iterator
from dataclasses import replace
from datetime import UTC, datetime
from functools import cache
from html.parser import HTMLParser
from pathlib import Path
from typing import Any, cast

import matplotlib
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from devices.air_track.capacity import CAPACITY as AIR_TRACK
from devices.quanser_st3.capacity import CAPACITY as ST3
from tests.twin.conftest import FREE, short_scene
from twin.commands.mechanics import mechanics_of
from twin.errors import InputError
from twin.plan import Plan, plan_run
from twin.plan_page.chart_of_outcomes import OutcomeChart, outcome_chart
from twin.plan_page.content import Content, Fact, content_of
from twin.plan_page.origin import Origin, origin_of
from twin.plan_page.page import check_ending, spread_of, write_page
from twin.plan_page.paper import DRAWN, HEIGHT, MARGIN, WIDTH, set_page
from twin.plan_page.typesetting import MONO, SANS, printable, shortened, width_of, wrapped
from twin.plan_page.web import page_text
from twin.scene import load_scene

MADE = datetime(2026, 11, 22, 3, 4, 5, tzinfo=UTC)
HOSTILE = [
    "<script>alert(1)</script>",
    '"><img src=http://evil.example/x onerror=alert(1)>',
    r"$\frac{1}{0}$ $ unbalanced { \ %",
    "a" * 4000,
    "\x00\x1b[31m\u202e\ud800",
    "\u5730\u9707 \U0001f30b \u0627\u0644",
    "</style></head><body onload=x>&amp;",
    "url(http://evil.example) ]]> <!-- -->",
]


@pytest.fixture(scope="module")
def plan() -> Plan:
    scene = short_scene(block="mass_kg = 2.5692")
    return plan_run(scene, ST3, mechanics=mechanics_of(scene, ST3))


@pytest.fixture(scope="module")
def chart(plan: Plan) -> OutcomeChart | None:
    return outcome_chart(plan, spread_of(plan))


@pytest.fixture(scope="module")
def origin() -> Origin:
    return origin_of(["plan", "b6l_sine", "--out", "my plan.pdf"], scene_argument="b6l_sine", made=MADE)


def titled(plan: Plan, text: str) -> Content:
    content = content_of(plan, Origin(text, MADE, {text: "0" * 64}, {"git": text}))
    stops = None if content.stops is None else replace(content.stops, title=text, rows=((text,) * 6,), note=text)
    return replace(
        content,
        name=text,
        title=text,
        verdict=text,
        facts=(*content.facts, Fact(text, text)),
        stops=stops,
        capacity=replace(content.capacity, rows=((text, text, text),), note=text),
    )


class Page(HTMLParser):
    """Words and attributes of an HTML file."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.words: list[str] = []
        self.tags: list[tuple[str, dict[str, str]]] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, {name: value or "" for name, value in attrs}))

    def handle_data(self, data: str) -> None:
        self.words.append(data)


def pdf_streams(path: Path) -> Iterator[bytes]:
    for found in re.finditer(rb"stream\r?\n(.*?)\r?\nendstream", path.read_bytes(), flags=re.DOTALL):
        try:
            yield zlib.decompress(found[1])
        except zlib.error:
            yield found[1]


def overhanging(figure: Any) -> list[str]:
    """Return the texts that run over an edge of the paper's margins."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    renderer = FigureCanvasAgg(figure).get_renderer()
    dpi = figure.dpi
    found: list[str] = []
    for text in figure.texts:
        with matplotlib.rc_context(cast("Any", DRAWN)):
            box = text.get_window_extent(renderer)
        inside = box.x0 >= (MARGIN - 0.02) * dpi and box.x1 <= (WIDTH - MARGIN + 0.02) * dpi
        if not (inside and box.y0 >= 0.1 * dpi and box.y1 <= (HEIGHT - 0.1) * dpi):
            found.append(text.get_text())
    return found


def test_the_page_says_what_it_must(plan: Plan, origin: Origin) -> None:
    content = content_of(plan, origin)
    text = "\n".join(content.texts)
    for needed in (
        "single sine",  # what is asked
        "recalled placeholder",  # where the numbers come from
        "of its futures" if plan.uncertain and plan.uncertain.probability.overturned else "stays up",
        "Emergency ramp-down at any moment",
        "end stops",
        "2026-11-22 03:04:05 UTC",
        "twin plan b6l_sine --out 'my plan.pdf'",
        "b6l_sine (shipped): ",
        "shake-table-twin",
        "numba",
        "git",
        "seed",
    ):
        assert needed in text, needed
    assert re.search(r"[0-9a-f]{64}", text)
    heads = [fact.head for fact in content.facts]
    for head in ("block", "table", "asked", "given", "predicted", "contact", "margin", "performed", "broken off"):
        assert head in heads


def test_nothing_runs_over_the_paper_or_another_line(plan: Plan, chart: OutcomeChart | None, origin: Origin) -> None:
    figure = set_page(plan, content_of(plan, origin), chart)
    assert overhanging(figure) == []
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    renderer = FigureCanvasAgg(figure).get_renderer()
    boxes = [text.get_window_extent(renderer) for text in figure.texts if text.get_text()]
    for i, one in enumerate(boxes):
        for other in boxes[i + 1 :]:
            across = min(one.x1, other.x1) - max(one.x0, other.x0)
            down = min(one.y1, other.y1) - max(one.y0, other.y0)
            assert across < 1.0 or down < 0.35 * min(one.height, other.height)


@pytest.mark.parametrize("ending", ["pdf", "png", "svg", "html"])
def test_every_format_is_written(ending: str, plan: Plan, origin: Origin, tmp_path: Path) -> None:
    path = tmp_path / "folder" / f"plan.{ending}"
    write_page(plan, path, origin)
    assert path.stat().st_size > 20_000
    if ending == "pdf":
        # One page of A4.
        assert len(re.findall(rb"/Type /Page\b(?!s)", path.read_bytes())) == 1
        box = re.search(rb"/MediaBox \[ ?0 0 ([0-9.]+) ([0-9.]+) ?\]", path.read_bytes())
        assert box is not None
        assert [float(box[1]), float(box[2])] == pytest.approx([595.3, 841.9], abs=0.2)
        assert any(b"BT" in stream for stream in pdf_streams(path))
        assert b"/Subtype /Type0" in path.read_bytes() or b"/CIDFontType2" in path.read_bytes()


def test_another_ending_is_one_sentence(plan: Plan, tmp_path: Path) -> None:
    for name in ("plan.xyz", "plan", "plan.jpg"):
        with pytest.raises(InputError, match=r"a page ends in \.pdf, \.png, \.svg or \.html"):
            write_page(plan, tmp_path / name)
        with pytest.raises(InputError):
            check_ending(Path(name))
    (tmp_path / "file").write_text("")
    for ending in ("pdf", "html"):
        with pytest.raises(InputError, match="cannot be written"):
            write_page(plan, tmp_path / "file" / f"plan.{ending}")


def test_the_html_fetches_nothing_and_says_everything(plan: Plan, chart: OutcomeChart | None, origin: Origin) -> None:
    content = content_of(plan, origin)
    text = page_text(plan, content, chart)
    page = Page(text)
    words = " ".join(page.words)
    for needed in content.texts:
        assert needed in words
    assert [tag for tag, _ in page.tags if tag in ("script", "link", "iframe", "object", "img", "base")] == []
    for _, attributes in page.tags:
        for name, value in attributes.items():
            if name in ("src", "href", "xlink:href", "data", "action"):
                assert value.startswith(("#", "data:image/png;base64,"))
            if not name.startswith("xmlns"):
                assert "://" not in value
    assert "@import" not in text
    assert not re.search(r"url\((?!#)", text)
    identities = re.findall(r'\bid="([^"]+)"', text)
    assert len(identities) == len(set(identities))
    assert {"name", "date and time", "signature"} <= set(page.words)


@pytest.mark.parametrize("text", HOSTILE)
def test_a_hostile_text_stays_text_on_paper(text: str, plan: Plan, chart: OutcomeChart | None, tmp_path: Path) -> None:
    figure = set_page(plan, titled(plan, text), chart)
    assert overhanging(figure) == []


@cache
def refused() -> Plan:
    """Return a plan without pictures: what the table cannot make."""
    return plan_run(load_scene("b6l_sine"), AIR_TRACK)


@settings(max_examples=60, deadline=None)
@given(text=st.text(min_size=1, max_size=200))
@example(text=HOSTILE[0])
@example(text=HOSTILE[1])
@example(text=HOSTILE[4])
@example(text=HOSTILE[6])
def test_a_hostile_text_stays_text_in_html(text: str) -> None:
    clean = page_text(refused(), titled(refused(), "plain"), None)
    hostile = page_text(refused(), titled(refused(), text), None)
    hostile.encode("utf-8")
    # The same elements with the same attributes, whatever the words.
    assert Page(hostile).tags == Page(clean).tags


@settings(max_examples=60, deadline=None)
@given(text=st.text(max_size=120), width=st.floats(30.0, 500.0), size=st.floats(4.0, 14.0))
def test_lines_are_as_wide_as_they_may_be_and_lose_nothing(text: str, width: float, size: float) -> None:
    lines = wrapped(text, width, size)
    assert all(width_of(line, size) <= width for line in lines)
    assert "".join(lines).replace(" ", "") == printable(text).replace(" ", "")
    assert width_of(shortened(text, width, size), size) <= width
    for family in (SANS, MONO):
        assert "\n" not in printable(text, family)


def test_what_cannot_be_made_and_what_does_not_shake_have_pages(tmp_path: Path) -> None:
    free = plan_run(short_scene(FREE, "initial_rotation_deg = 5"), ST3)
    for name, each in (("refused", refused()), ("free", free)):
        for ending in ("png", "html"):
            write_page(each, tmp_path / f"{name}.{ending}")


def test_a_machine_that_nothing_stops_says_so() -> None:
    from devices.roori1.capacity import CAPACITY as ROORI1

    content = content_of(plan_run(load_scene("b6l_double_pulse"), ROORI1))
    assert content.stops is None
    assert any("nothing stops this machine" in fact.text for fact in content.facts)


def test_the_origin_names_files_by_their_content(tmp_path: Path) -> None:
    scene = tmp_path / "mine.toml"
    scene.write_bytes(b"abc")
    record = tmp_path / "r.at2"
    record.write_bytes(b"")
    found = origin_of(["plan", str(scene)], scene_argument=str(scene), record=record, made=MADE)
    assert found.files == {
        "mine.toml": "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad",
        "r.at2": "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855",
    }
    assert found.made_words == "2026-11-22 03:04:05 UTC"
