"""What a crew knows of scans that are given as plain files."""

from pathlib import Path

import pytest

from flows.model_structure import seen_targets
from flows.survey_file import Survey, read_survey
from schemas.problem import BadInput

SCANS = [Path("a/east.ply"), Path("b/west.ply")]
SURVEY = """
name: bridge  # a whole inspection will do
targets: [{name: S1, position_m: [10, 20, 3]}, {name: S2, position_m: [14, 20, 3], check: true}]
scans: [{file: scans/east.ply, unit: mm, position_m: [1, 2, 3], targets: {S1: [100, 200, 300]}}]
"""


def written(folder: Path, text: str) -> Path:
    path = folder / "survey.yaml"
    path.write_text(text)
    return path


def test_scans_are_known_by_their_names(tmp_path: Path) -> None:
    survey = read_survey(written(tmp_path, SURVEY), SCANS)
    assert [(t.name, t.check) for t in survey.targets] == [("S1", False), ("S2", True)]
    east, west = (survey.of(path, "cm") for path in SCANS)
    assert (east.unit, east.position_m) == ("mm", (1.0, 2.0, 3.0))
    assert seen_targets(east)[0].position == (100.0, 200.0, 300.0)
    assert (west.unit, west.position_m, west.targets) == ("cm", None, {})
    assert Survey().of(SCANS[0], "m").unit == "m"


def test_what_is_wrong_is_named(tmp_path: Path) -> None:
    with pytest.raises(BadInput, match=r"north\.ply, which is not given"):
        read_survey(written(tmp_path, "scans: [{file: north.ply}]"), SCANS)
    with pytest.raises(BadInput, match=r"targets\.0\.position_m"):
        read_survey(written(tmp_path, "targets: [{name: S1, position_m: [1, 2]}]"), SCANS)
    with pytest.raises(BadInput, match="holds no settings"):
        read_survey(written(tmp_path, "- 1"), SCANS)
