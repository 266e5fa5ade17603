"""`hairline init` writes a file that `hairline run` reads, every setting explained."""

import errno
import os
import shlex
from pathlib import Path

import pytest
import yaml

from flows.command_line import init
from flows.init_inspection import SECTIONS, described, init_inspection
from flows.inspection_file import read_inspection
from schemas.inspection import Inspection
from schemas.problem import BadInput


def site(tmp_path: Path, *names: str) -> Path:
    folder = tmp_path / "North Pier: 2"
    for name in names:
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).touch()
    return folder


def test_what_lies_in_the_folder_is_found(tmp_path: Path) -> None:
    folder = site(
        tmp_path,
        *("scans/a.ply", "scans/b: c.e57", "photos/1.jpg", "photos/2.JPG", "flight.BIN"),
        *("photos/.thumbnails/1.jpg", "scans/._a.ply", "@eaDir/2.jpg"),
    )
    inspection = read_inspection(init_inspection(folder, None))
    assert inspection.name == "North-Pier-2"
    assert [scan.file for scan in inspection.scans] == ["scans/a.ply", "scans/b: c.e57"]
    assert [photos.folder for photos in inspection.photos] == ["photos"]
    assert (inspection.flight, inspection.flight_log) == ("external", "flight.BIN")


@pytest.mark.parametrize(
    ("folder", "name"),
    [
        *((same, same) for same in ("2024-05-01", "007", "no", "桥梁", "पुल", "null")),
        ("Brücke Süd", "Brücke-Süd"),
        ("Bru\u0308cke", "Brücke"),  # as macOS writes it
        ("-x", "x"),
        ("#?!", "inspection"),
    ],
)
def test_it_is_called_by_its_folder(tmp_path: Path, folder: str, name: str) -> None:
    (tmp_path / folder).mkdir()
    (tmp_path / folder / "1.jpg").touch()
    assert read_inspection(init_inspection(tmp_path / folder, None)).name == name


def test_file_names_are_found_again_or_refused(tmp_path: Path) -> None:
    names = ["a\x1b\x7f\x85\u2028.ply", 'b"\\.ply', "桥.ply"]
    folder = site(tmp_path, *names)
    assert [scan.file for scan in read_inspection(init_inspection(folder, None)).scans] == names
    (folder / "inspection.yaml").unlink()
    (folder / "\udcff.ply").touch()
    with pytest.raises(BadInput, match="its name is not in UTF-8"):
        init_inspection(folder, None)


@pytest.mark.parametrize("code", [errno.ENOSPC, errno.EROFS])
def test_a_folder_that_takes_no_file_is_told_and_left_as_it_was(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, code: int
) -> None:
    def refuse(path: Path, text: str, encoding: str) -> None:
        path.touch()
        raise OSError(code, os.strerror(code))

    folder = site(tmp_path, "1.jpg")
    monkeypatch.setattr(Path, "write_text", refuse)
    with pytest.raises(
        BadInput, match=rf"North Pier: 2: cannot be written to \({os.strerror(code)}\)\. Free"
    ):
        init_inspection(folder, None)
    assert [path.name for path in folder.iterdir()] == ["1.jpg"]


def test_the_command_to_run_it_can_be_pasted(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert init(site(tmp_path, "p/1.jpg")) == 0
    assert shlex.split(capsys.readouterr().out)[-1] == str(tmp_path / "North Pier: 2" / "inspection.yaml")


def test_the_explained_settings_are_the_defaults(tmp_path: Path) -> None:
    path = init_inspection(site(tmp_path, "p/1.jpg"), "x")
    text = path.read_text()
    sections = text[text.index("\n# vehicle:") :]
    uncommented = "\n".join(line[2:] for line in sections.splitlines() if line.startswith("# "))
    settings = yaml.safe_load(uncommented)
    assert settings.keys() == SECTIONS.keys()
    assert Inspection.model_validate({"name": "x"} | settings) == Inspection(name="x")


@pytest.mark.parametrize("section", SECTIONS)
def test_most_settings_say_why(section: str) -> None:
    lines = described(SECTIONS[section])
    assert sum("  # " in line for line in lines) >= 0.6 * len(lines), lines
    assert not any("None" in line for line in lines)  # YAML says null


def test_an_inspection_that_is_there_is_not_written_over(tmp_path: Path) -> None:
    folder = site(tmp_path, "p/1.jpg")
    init_inspection(folder, None)
    with pytest.raises(BadInput, match="is there already"):
        init_inspection(folder, None)


def test_an_empty_folder_is_told(tmp_path: Path) -> None:
    with pytest.raises(BadInput, match="neither scans nor photos"):
        init_inspection(tmp_path, None)
