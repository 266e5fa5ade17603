"""How a command ends that did not come to its end."""

import errno
import sys
from pathlib import Path

import pytest

from flows import command_line


def said_at_the_end(
    words: list[str],
    problem: BaseException,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> str:
    def stopped(**_: object) -> None:
        raise problem

    monkeypatch.setattr(command_line, "app", stopped)
    monkeypatch.setattr(command_line, "add_commands", lambda: None)
    monkeypatch.setattr(sys, "argv", ["hairline", *words])
    with pytest.raises(SystemExit):
        command_line.main()
    return capsys.readouterr().err


@pytest.mark.parametrize("problem", [KeyboardInterrupt(), RuntimeError("odd")])
def test_stages_are_said_to_be_kept_where_they_are(
    problem: BaseException,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    for words, kept in ((["run", "a.yaml"], True), (["demo"], True), (["stitch", "run"], False), ([], False)):
        said = said_at_the_end(words, problem, monkeypatch, capsys)
        assert ("finished stages are kept" in said) == kept
        assert len(said.splitlines()) == 1


def test_a_full_disk_keeps_no_empty_file_of_details(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def full(path: Path, text: str, encoding: str) -> None:
        path.touch()
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(Path, "write_text", full)
    said = said_at_the_end(["run"], RuntimeError("odd"), monkeypatch, capsys)
    assert "RuntimeError: odd (its details could not be written here" in said
    assert not list(tmp_path.iterdir())
