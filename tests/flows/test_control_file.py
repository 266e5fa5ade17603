"""CONTROL.yaml of `hairline stitch`, and control in the inspection file."""

from pathlib import Path

import pytest

from flows.plain_files import read_control
from schemas.inspection import Inspection
from schemas.problem import BadInput

TEXT = """
tags: APRILTAG_36H11
marks: {A: {DJI_0012.JPG: [1204.5, 811], DJI_0013.JPG: [377, 820.5]}}
targets:
  - {mark: "3", uv_m: [0, 0]}
  - {mark: "7", uv_m: [12.412, 0.305]}
  - {mark: A, uv_m: [6.1, 2.25], check: true}
scale_bars: [{ends: ["3", A], length_mm: 6502}]
"""


def test_the_readmes_file_is_read(tmp_path: Path) -> None:
    path = tmp_path / "control.yaml"
    path.write_text(TEXT)
    control = read_control(path)
    assert control.marks["A"]["DJI_0013.JPG"] == (377, 820.5)
    assert [t.check for t in control.targets] == [False, False, True]
    assert control.scale_bars[0].length_mm == 6502
    assert TEXT.split("tags")[1].splitlines()[1] in Path("README.md").read_text()
    of_wall = Inspection(name="x", control={"wall": control})
    assert Inspection.model_validate_json(of_wall.model_dump_json()).control == {"wall": control}


@pytest.mark.parametrize(
    ("text", "what"),
    [
        ("targets: [", "not valid YAML"),
        ("targets: [{mark: A, uv_m: [0, 0]}]", "A"),
        ("tags: QR\nscale_bars: [{ends: [a, b], length_mm: 1}]", "tags"),
        ("", "control.yaml"),
    ],
)
def test_what_it_cannot_use_is_one_clear_error(tmp_path: Path, text: str, what: str) -> None:
    path = tmp_path / "control.yaml"
    path.write_text(text)
    with pytest.raises(BadInput, match=what):
        read_control(path)
