"""The README's commands are those that work, and every command is in it or in a command's help."""

import re
import shlex
from pathlib import Path

import pytest
import yaml

from tests.end_to_end.commands import HAIRLINE, hairline
from tests.small_inspection import write_inspection

REPOSITORY = Path(__file__).parents[1]
README = (REPOSITORY / "README.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"```sh\n(.*?)```", README, flags=re.DOTALL)
LINES = [line.split("#")[0].strip() for block in BLOCKS for line in block.splitlines()]


def commands(first: str) -> list[list[str]]:
    return [shlex.split(line) for line in LINES if line.startswith(first + " ")]


def test_the_make_targets_exist_and_stand_first() -> None:
    targets = re.findall(r"^([a-z]+):", (REPOSITORY / "Makefile").read_text(), flags=re.MULTILINE)
    assert [words[1] for words in commands("make")] == ["demo", "test"]
    assert {"demo", "test"} <= set(targets)
    assert BLOCKS[0].startswith("make demo")


def test_ci_runs_the_readmes_test_command() -> None:
    assert "make test" in (REPOSITORY / ".ci/run").read_text()


@pytest.mark.parametrize("words", commands("hairline"), ids=" ".join)
def test_each_hairline_line_is_understood(words: list[str]) -> None:
    """Its command and its options exist; paths are the user's own."""
    from flows.command_line import add_commands, app

    add_commands()
    _command, bound, unused, _ = app.parse_known_args(words[1:])
    assert bound is not None
    assert not unused


def test_every_command_is_in_the_readme() -> None:
    from flows.command_line import add_commands, app

    add_commands()
    named = {name for name in app if not name.startswith("-")}  # options are in --help
    assert named
    assert {name for name in named if f"`{name}`" not in README and f"hairline {name}" not in README} == set()


def test_the_deployments_of_the_readme_are_those_of_prefect_yaml() -> None:
    deployments = yaml.safe_load((REPOSITORY / "prefect.yaml").read_text())["deployments"]
    for deployment in deployments:
        assert f"`{deployment['name']}`" in README
        path, function = deployment["entrypoint"].split(":")
        assert f"def {function}(" in (REPOSITORY / path).read_text()


def test_a_first_inspection_goes_as_the_readme_says(tmp_path: Path) -> None:
    """init, a look at the file, dry run, run: the ten lines, with photos alone."""
    write_inspection(tmp_path / "girder", photos=2)
    (tmp_path / "girder" / "inspection.yaml").unlink()
    hairline("init", "girder", cwd=tmp_path)
    path = tmp_path / "girder" / "inspection.yaml"
    path.write_text(path.read_text().replace("stitch: true", "stitch: false, gsd_mm_px: 0.5"))
    assert "will run" in hairline("run", "girder/inspection.yaml", "--dry-run", cwd=tmp_path).stdout
    hairline("run", "girder/inspection.yaml", cwd=tmp_path)
    assert (tmp_path / "runs/girder/report/index.html").is_file()


def test_the_command_is_installed() -> None:
    assert HAIRLINE.is_file()
