"""What the README shows works as it stands there."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from devices.capacity_file import load_capacity
from twin.cli import COMMANDS, main
from twin.scene import load_scene, parse_scene

ROOT = Path(__file__).resolve().parent.parent
README = (ROOT / "README.md").read_text(encoding="utf-8")


def blocks(language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", README, flags=re.DOTALL)


def test_it_opens_with_two_commands() -> None:
    assert "pip install . && twin run\npip install -e '.[test]' && pytest\n" in blocks("")[0]


@pytest.mark.parametrize(("number", "shown"), [(0, "Outcome.ROCKED"), (1, "5494")])
def test_the_python(number: int, shown: str, capsys: pytest.CaptureFixture[str]) -> None:
    exec(compile(blocks("python")[number], "README.md", "exec"), {})  # noqa: S102 - our own README
    assert shown in capsys.readouterr().out


def test_the_scene_is_the_shipped_one() -> None:
    scene = parse_scene(blocks("toml")[0], name="readme", folder=Path())
    assert scene.model_dump() == load_scene("b6l_sine").model_dump()


def test_every_key_the_scene_mentions_exists() -> None:
    text = blocks("toml")[0]
    for line in re.findall(r"^# ([a-z_]+) = ([^ \n]+)", text, flags=re.MULTILINE):
        parse_scene(text.replace(f"# {line[0]} = {line[1]}", f"{line[0]} = {line[1]} #"), name="x", folder=Path())


def test_the_capacity() -> None:
    capacity = load_capacity(blocks("toml")[1])
    assert capacity.stroke == pytest.approx(0.216)
    assert capacity.provenance["stroke"] == "data sheet of 2019, p. 3"


def test_the_plan_shown_is_the_plan_made(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["plan", "b6l_sine"]) == 0
    made = capsys.readouterr().out
    shown = next(block for block in blocks("") if block.startswith("$ twin plan"))
    for line in shown.splitlines()[1:]:
        assert line in made


def test_every_command_is_in_the_table() -> None:
    for command in COMMANDS:
        assert f"| `twin {command}" in README


def test_pictures_exist() -> None:
    for name in re.findall(r"\]\((docs/[^)]+)\)", README):
        assert (ROOT / name).exists()
