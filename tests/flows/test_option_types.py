"""Numbers of options are checked as they are read, and a mistake is told by the option's name."""

import sys
from pathlib import Path

import pytest
from cyclopts import CycloptsError
from pydantic import ValidationError

from flows import command_line
from flows.option_types import of_options
from flows.plan_command import plan
from schemas.inspection import PhotoSet
from schemas.problem import BadInput
from schemas.settings import DetectSettings, SurfaceSettings

command_line.add_commands()


@pytest.mark.parametrize("mm_px", ["0", "-0.5", "nan", "inf", "1e-9", "5000"])
@pytest.mark.parametrize(
    "words", [["detect", "p"], ["measure", "p", "m"], ["evaluate", "p", "m"], ["stitch", "p"]]
)
def test_a_ground_sample_distance_that_no_photo_has_is_refused(words: list[str], mm_px: str) -> None:
    refused = r"--gsd-mm-px\. Give 0\.001 to 1000 mm per pixel"
    with pytest.raises(CycloptsError, match=refused):
        command_line.app([*words, "--out", "o", "--gsd-mm-px", mm_px], exit_on_error=False)
    with pytest.raises(ValidationError, match="gsd_mm_px"):
        PhotoSet(folder="p", gsd_mm_px=float(mm_px))


def test_settings_that_cannot_be_are_told_by_their_option() -> None:
    with pytest.raises(BadInput, match="--min-score: cannot be 7"):
        of_options(DetectSettings, min_score=7.0)
    with pytest.raises(BadInput, match="--min-area-m2: cannot be -1"):
        of_options(SurfaceSettings, min_area_m2=-1.0)


def test_a_contract_broken_inside_is_not_blamed_on_settings(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(**_: object) -> None:
        PhotoSet.model_validate({})

    monkeypatch.setattr(command_line, "app", broken)
    monkeypatch.setattr(command_line, "_for_a_bug_report", lambda problem: type(problem).__name__)
    monkeypatch.setattr(sys, "argv", ["hairline"])
    with pytest.raises(SystemExit) as ended:
        command_line.main()
    assert ended.value.code == 1
    assert "Unexpected error: ValidationError" in capsys.readouterr().err


@pytest.mark.parametrize("words", [["--stand-off-m", "-3"], ["--stand-off-m", "0"], ["--area-m2", "nan"]])
def test_a_table_of_nonsense_is_refused(words: list[str]) -> None:
    with pytest.raises(CycloptsError, match=rf"{words[0]}\. Give a number greater than 0"):
        command_line.app(["plan", "--what-if", "--camera", "c.yaml", *words], exit_on_error=False)


def test_an_option_of_a_plan_is_told_as_such_and_a_key_of_its_file_by_the_file(tmp_path: Path) -> None:
    camera = tmp_path / "c.yaml"
    camera.write_text("width_px: 400\nheight_px: 300\nfocal_px: 300\nplan: {voxel_m: -1}\n")
    (tmp_path / "good.yaml").write_text("width_px: 400\nheight_px: 300\nfocal_px: 300\n")
    with pytest.raises(BadInput, match=r"^--overlap: cannot be 0\.99"):
        plan(camera=tmp_path / "good.yaml", what_if=True, overlap=0.99)
    with pytest.raises(BadInput, match=r"^--free: "):
        plan(camera=tmp_path / "good.yaml", what_if=True, free=[(1, 1, 1, 0, 0, 0)])
    with pytest.raises(BadInput) as caught:
        plan(camera=camera, what_if=True)
    assert caught.value.item == str(camera)
