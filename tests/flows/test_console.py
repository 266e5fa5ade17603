"""What the terminal shows of a run, and of names that it should not obey."""

import pytest

from flows.console import StageLines, plain
from tasks.run import Event


def test_what_a_stage_notes_stands_before_the_stage_has_ended(capsys: pytest.CaptureFixture[str]) -> None:
    with StageLines() as lines:
        lines(Event("fly", "started"))
        lines(Event("fly", "noted", detail="RTL_ALT set from 1500 to 850 [cm]"))
        lines(Event("fly", "ran", detail="2.0 s"))
    assert capsys.readouterr().out.splitlines() == [
        "  … fly",
        "  ! RTL_ALT set from 1500 to 850 [cm]",
        "  ✓ fly: 2.0 s",
    ]


def test_a_stage_that_broke_has_no_line_that_says_it_is_done(capsys: pytest.CaptureFixture[str]) -> None:
    with StageLines() as lines:
        lines(Event("ingest", "failed", "a.jpg", detail="a.jpg: is damaged"))
        lines(Event("ingest", "ran", "b.jpg", detail="1.0 s"))
        lines(Event("detect", "ran", "b.jpg", detail="1.0 s"))
        lines(Event("detect", "broke", "c.jpg", detail="OSError: no space"))
        lines(Event("detect", "ran", "d.jpg", detail="1.0 s"))
    assert capsys.readouterr().out.splitlines() == [
        "  ✗ ingest: a.jpg: is damaged",
        "  ✓ ingest: 1.0 s",
        "  ✗ detect: OSError: no space",
    ]


def test_what_a_terminal_would_obey_is_shown() -> None:
    assert plain("Süd [1]\x1b[31m\udcff\n") == "Süd \\[1]\\x1b\\[31m\\udcff\n"
