import pytest

from flows.console import StageLines
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
