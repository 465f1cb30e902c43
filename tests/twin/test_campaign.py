"""Campaigns as files: what is read, what is refused, and that nothing in one says where anything is written."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.twin.conftest import SHORT, SINE
from twin.campaign import LEVELS, RunPart, campaign_text, is_campaign, load_campaign, parse_campaign
from twin.errors import InputError
from twin.scene_parts import RecordPart, WavePart


def test_a_campaign_is_runs_at_staged_levels(tmp_path: Path) -> None:
    (tmp_path / "mine.toml").write_text(SHORT.format(block="", excitation=SINE), encoding="utf-8")
    (tmp_path / "all.toml").write_text(
        """
        scene = "mine.toml"
        [[run]]
        name = "as it is"
        [[run]]
        scene = "b6l_cosine"
        levels_percent = [50, 50, 100]
        [run.excitation]
        kind = "cosine"
        amplitude_g = 0.2
        frequency_hz = 3
        """,
        encoding="utf-8",
    )
    campaign = load_campaign(str(tmp_path / "all.toml"))
    assert [step.level for step in campaign.steps] == [*LEVELS, 50, 50, 100]
    assert [step.number for step in campaign.steps] == [1, 2, 3, 4, 5, 6, 7]
    assert [step.scene.name for step in campaign.steps] == ["mine"] * 4 + ["b6l_cosine"] * 3
    first, last = campaign.steps[0].scene.pulse(), campaign.steps[-1].scene.pulse()
    assert first is not None
    assert last is not None
    assert first.peak_acceleration == pytest.approx(0.1 * 0.3 * 9.81)
    assert last.peak_acceleration == pytest.approx(0.2 * 9.81)
    assert campaign.steps[4].title == "run 2 at 50 %"


def test_the_scenes_own_gain_counts_too(tmp_path: Path) -> None:
    text = SHORT.format(block="", excitation=SINE).replace("settle_s = 0.1", "settle_s = 0.1\ngain = 0.5")
    (tmp_path / "half.toml").write_text(text, encoding="utf-8")
    campaign = parse_campaign('scene = "half.toml"\n[[run]]', name="c", folder=tmp_path)
    assert [step.scene.table.gain for step in campaign.steps] == [0.05, 0.125, 0.25, 0.5]


def test_paths_start_at_the_campaigns_folder(tmp_path: Path) -> None:
    (tmp_path / "scenes").mkdir()
    (tmp_path / "scenes" / "mine.toml").write_text(SHORT.format(block="", excitation=SINE), encoding="utf-8")
    text = """
        scene = "../scenes/mine.toml"
        [[run]]
        [run.excitation]
        kind = "record"
        path = "quake.at2"
    """
    (tmp_path / "here").mkdir()
    campaign = parse_campaign(text, name="c", folder=tmp_path / "here")
    excitation = campaign.steps[0].scene.excitation
    assert isinstance(excitation, RecordPart)
    assert Path(excitation.path) == tmp_path / "here" / "quake.at2"


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("[[run]]", "run.0 has no scene"),
        ('scene = "nowhere.toml"\n[[run]]', "cannot read"),
        ('scene = "b6l_sinus"\n[[run]]', "neither a shipped scene nor a .toml file"),
        ('scene = "b6l_sine"\nrun = []', "run"),
        ('scene = "b6l_sine"\nlevels_percent = [100, 10]\n[[run]]', "must not go down"),
        ('scene = "b6l_sine"\nlevels_percent = [0]\n[[run]]', "greater than 0"),
        ('scene = "b6l_sine"\nlevels_percent = [110]\n[[run]]', "less than or equal to 100"),
        ('scene = "b6l_sine"\nlevels_percent = [nan]\n[[run]]', "finite"),
        ('scene = "b6l_sine"\nlevels_percent = []\n[[run]]', "at least 1"),
        ('scene = "b6l_sine"\n[[run]]\nlevel_percent = [1]', "did you mean levels_percent"),
        (
            'scene = "b6l_sine"\n[[run]]\n[run.excitation]\nkind = "sine"\namplitude_g = "1"\nfrequency_hz = 1',
            "amplitude_g",
        ),
        ('scene = "b6l_sine"\n[[run]]\nout = "/etc/passwd"', "not a key here"),
        ("[[run]", "no TOML"),
    ],
)
def test_what_is_wrong_is_one_sentence(text: str, said: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="campaign c") as refused:
        parse_campaign(text, name="c", folder=tmp_path)
    assert said in str(refused.value)
    assert "\n" not in str(refused.value)


@given(name=st.text(min_size=1, max_size=60))
def test_a_runs_name_is_no_path(name: str) -> None:
    toml = campaign_text("", "b6l_sine", [RunPart(name=name)], (50.0,), Path())
    (step,) = parse_campaign(toml, name="c", folder=Path()).steps
    assert step.run == name
    assert Path(step.slug).name == step.slug
    assert step.slug.startswith("001-")
    assert set(step.slug) <= set("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-_")


def test_what_is_written_reads_back(tmp_path: Path) -> None:
    excitation = WavePart(kind="sine", amplitude_g=0.61, frequency_hz=3.2)
    runs = [RunPart(name='a "quoted" \\ name', why="weil\nes so ist", excitation=excitation), RunPart(name="b")]
    runs[1] = RunPart(name="b", levels_percent=(100.0,))
    scene = tmp_path / "scenes" / "b6l_sine.toml"
    scene.parent.mkdir()
    scene.write_text(SHORT.format(block="", excitation=SINE), encoding="utf-8")
    text = campaign_text("title", str(scene), runs, (10.0, 100.0), tmp_path / "campaigns")
    assert '"../scenes/b6l_sine.toml"' in text
    (tmp_path / "campaigns").mkdir()
    campaign = parse_campaign(text, name="c", folder=tmp_path / "campaigns")
    assert [step.title for step in campaign.steps] == [
        'a "quoted" \\ name at 10 %',
        'a "quoted" \\ name at 100 %',
        "b at 100 %",
    ]
    assert campaign.steps[0].scene.excitation == excitation
    assert campaign.steps[0].why == "weil\nes so ist"
    assert campaign.steps[2].scene.title == "a quick one"


def test_a_campaign_is_told_from_a_scene(tmp_path: Path) -> None:
    for name, text in (
        ("campaign", '[[run]]\nscene = "b6l_sine"'),
        ("scene", SHORT.format(block="", excitation=SINE)),
        ("both", SHORT.format(block="", excitation=SINE) + "[[run]]"),
        ("broken", "[[run"),
    ):
        (tmp_path / f"{name}.toml").write_text(text, encoding="utf-8")
    assert [
        is_campaign(str(tmp_path / f"{name}.toml")) for name in ("campaign", "scene", "both", "broken", "none")
    ] == [
        True,
        False,
        False,
        False,
        False,
    ]
    assert not is_campaign("b6l_sine")


VALUES = st.recursive(
    st.none()
    | st.booleans()
    | st.integers(-5, 300)
    | st.floats()
    | st.text(max_size=12)
    | st.sampled_from(["b6l_sine"]),
    lambda inner: (
        st.lists(inner, max_size=4)
        | st.dictionaries(
            st.sampled_from(["kind", "name", "scene", "levels_percent", "excitation", "x"]), inner, max_size=4
        )
    ),
    max_leaves=12,
)


def _toml(value: object) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, dict):
        return "{" + ", ".join(f"{key} = {_toml(item)}" for key, item in value.items() if item is not None) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(_toml(item) for item in value if item is not None) + "]"
    if isinstance(value, str):
        return (
            '"'
            + "".join(c if c.isalnum() else f"\\U{ord(c):08X}" for c in value if not 0xD800 <= ord(c) < 0xE000)
            + '"'
        )
    return repr(value)


@given(st.dictionaries(st.sampled_from(["title", "scene", "levels_percent", "run", "y"]), VALUES, max_size=5))
def test_any_file_is_a_campaign_or_a_sentence(content: dict[str, object]) -> None:
    text = "\n".join(f"{key} = {_toml(value)}" for key, value in content.items() if value is not None)
    _read(text)


@given(st.text(max_size=200))
def test_any_text_is_a_campaign_or_a_sentence(text: str) -> None:
    _read(text)


def _read(text: str) -> None:
    try:
        campaign = parse_campaign(text, name="c", folder=Path("nowhere"))
    except InputError:
        return
    assert all(0.0 < step.scene.table.gain <= 1.0 for step in campaign.steps)
