"""What the commands of single stages share: files that are none, folders that cannot be written to."""

import errno
from collections.abc import Callable
from pathlib import Path

import pytest

from flows.collect_images import collect
from flows.flight_commands import convert_log
from flows.opening import opened
from flows.output_folder import told_when_full
from flows.plain_files import photos_in, read_camera, read_contract, read_control, refuse_unless_file, working
from flows.structure_commands import register
from schemas.file import File
from schemas.flight_plan import FlightPlan
from schemas.inspection import Inspection, PhotoSet
from schemas.problem import BadInput
from tasks.flight.recording import Fix, Recording, Trigger
from tests.flows.test_watch import picture
from tests.small_inspection import write_inspection


@pytest.mark.parametrize(
    "read", [refuse_unless_file, read_camera, read_control, lambda path: read_contract(path, FlightPlan)]
)
def test_a_folder_in_place_of_a_file_is_called_one(tmp_path: Path, read: Callable[[Path], object]) -> None:
    with pytest.raises(BadInput, match="is a folder"):
        read(tmp_path)


def test_a_disk_that_gets_full_is_told_by_its_folder(tmp_path: Path) -> None:
    told = r"out: cannot be written to \(No space left on device\). Free space there, or give another --out"
    with pytest.raises(BadInput, match=told), told_when_full(tmp_path / "none", tmp_path / "out"):
        (tmp_path / "out").mkdir()
        raise OSError(errno.ENOSPC, "No space left on device")
    with pytest.raises(PermissionError), told_when_full(tmp_path):
        raise PermissionError(errno.EACCES, "Permission denied")


def test_a_folder_named_like_a_photo_is_none(tmp_path: Path) -> None:
    folder = tmp_path / "photos"
    (folder / "sub.jpg").mkdir(parents=True)
    with pytest.raises(BadInput, match="holds no photo"):
        photos_in(folder)
    picture(0).save(folder / "a.jpg")
    assert photos_in(folder) == [folder / "a.jpg"]
    inspection = Inspection(name="x", photos=(PhotoSet(folder="photos"),))
    collected = collect(inspection, tmp_path, None, lambda plan: None)
    assert [photo.name for photo in collected.photos] == ["a.jpg"]


@pytest.mark.parametrize("name", ["file", "file/below"])
def test_an_output_folder_that_cannot_be_is_told_before_anything_starts(tmp_path: Path, name: str) -> None:
    (tmp_path / "file").write_text("no folder")
    told = r"file.*: cannot be made or written to \(.*Give another --out"
    with pytest.raises(BadInput, match=told), working(tmp_path / name):
        pass
    inspection = write_inspection(tmp_path / "site", photos=1)
    with pytest.raises(BadInput, match=told), opened(str(inspection), str(tmp_path / name)):
        pass


def test_an_output_folder_that_cannot_be_written_to_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refused(**_: object) -> None:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr("tempfile.TemporaryFile", refused)
    with pytest.raises(BadInput, match="Permission denied"), working(tmp_path):
        pass


def test_a_log_is_not_converted_over_itself_or_a_folder(tmp_path: Path) -> None:
    log = tmp_path / "flight.BIN"
    log.write_bytes(b"\xa3\x95 raw")
    (tmp_path / "link.mcap").symlink_to(log)
    for out, told in (
        (log, "is the log itself"),
        (tmp_path / "link.mcap", "is the log itself"),
        (tmp_path, "is a folder"),
    ):
        with pytest.raises(BadInput, match=told):
            convert_log(log, out=out)
    assert log.read_bytes() == b"\xa3\x95 raw"
    with pytest.raises(BadInput, match="Convert one log"):
        convert_log(tmp_path, out=tmp_path / "o.mcap")


def test_a_converted_log_is_told_by_what_it_holds(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    fixes = [Fix(10.0 + k, 47.0, 8.0, 400.0, 5.0, 0.0) for k in range(91)]
    whole = Recording(fixes=fixes, triggers=[Trigger(fixes[3], 0.0, 1)])
    for name, recording in (("whole.BIN", whole), ("cut.BIN", Recording())):
        (tmp_path / name).touch()
        monkeypatch.setattr("tasks.flight.task.convert", lambda log, out, held=recording: held)
        convert_log(tmp_path / name, out=tmp_path / "o.mcap")
    said = capsys.readouterr()
    assert "1.5 min, 91 positions, 1 photos" in said.out
    assert "cut.BIN holds no position" in said.err
    assert "whole.BIN" not in said.err


def test_no_scan_is_told(tmp_path: Path) -> None:
    with pytest.raises(BadInput, match="no scan is given"):
        register(out=tmp_path / "out")


def test_json_of_another_form_is_told_in_words(tmp_path: Path) -> None:
    path = tmp_path / "file.json"
    for text, told in (
        ("{", r"file\.json: is not valid JSON \("),
        ('{"sha256": "x", "size": 1, "suffix": ""}', "key 'sha256' cannot be 'x'"),
    ):
        path.write_text(text)
        with pytest.raises(BadInput, match=told):
            read_contract(path, File)
