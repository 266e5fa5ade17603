"""The photos in a folder, and what else is there."""

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from artifacts.mosaic import MosaicWriter
from flows.given_photos import given_photos
from flows.photo_files import photo_files
from flows.plain_files import photos_in
from schemas.inspection import Inspection, PhotoSet
from schemas.problem import BadInput


def photo(path: Path) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    Image.fromarray(np.full((40, 60, 3), 90, np.uint8)).save(path)


def own_mosaic(folder: Path) -> None:
    with MosaicWriter(folder, 64, 48, 0.5, (0.0, 0.0), "own plane") as writer:
        shape = (48, 64)
        writer.put(
            0, 0, np.full((*shape, 3), 90, np.uint8), np.full(shape, 255, np.uint8), np.ones(shape, np.uint16)
        )


def test_what_is_not_taken_is_said_in_a_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for name in ("1.jpg", "sub/2.jpg", "3.gif", "4.gif"):
        photo(tmp_path / name)
    for name in ("1.DNG", "5.webp", "notes.txt"):  # 1.DNG is the camera's raw of 1.jpg
        (tmp_path / name).write_bytes(b"x")
    (tmp_path / "empty").mkdir()
    listed = photo_files(tmp_path, "card")
    assert listed.paths == [tmp_path / "1.jpg"]
    assert [one.item for one in listed.not_taken] == ["2 GIF in card", "1 WEBP in card", "sub in card"]
    assert photos_in(tmp_path) == listed.paths
    said = capsys.readouterr().err
    assert "sub in" in said and "a folder with photos, not looked into" in said


def test_hidden_files_and_those_of_programs_are_no_photos(tmp_path: Path) -> None:
    hidden = [".hidden.jpg", "._1.jpg", ".thumbnails/1.jpg", "@eaDir/1.jpg/small.jpg", "empty/.x.jpg"]
    for name in ["1.jpg", *hidden]:
        photo(tmp_path / name)
    (tmp_path / "Thumbs.db").write_bytes(b"x")
    assert photo_files(tmp_path, "card") == ([tmp_path / "1.jpg"], ())


def test_folders_listed_besides_and_those_of_our_results_are_not_missed(tmp_path: Path) -> None:
    photo(tmp_path / "all/1.jpg")
    photo(tmp_path / "all/deck/2.jpg")
    photo(tmp_path / "all/runs/all/report/photos/1.jpg")
    (tmp_path / "all/out").mkdir()
    own_mosaic(tmp_path / "all/out")
    assert photo_files(tmp_path / "all", "all", others=[(tmp_path / "all/deck").resolve()]).not_taken == ()
    inspection = Inspection(name="x", photos=(PhotoSet(folder="all"),))
    _, left_out = given_photos(inspection, tmp_path, None)
    assert [one.item for one in left_out] == ["deck in all"]


def test_own_mosaics_are_no_photos(tmp_path: Path) -> None:
    own_mosaic(tmp_path)
    with pytest.raises(BadInput, match="Hairline's own mosaics are none"):
        photo_files(tmp_path, "out")
    assert photo_files(tmp_path, "out", mosaics=True).paths == [tmp_path / "image.tif"]
    photo(tmp_path / "1.tif")
    for mosaics in (False, True):
        assert photo_files(tmp_path, "out", mosaics=mosaics).paths == [tmp_path / "1.tif"]


def test_masks_of_pictures_beside_them_are_no_photos(tmp_path: Path) -> None:
    for name in ("1.jpg", "1.mask.png", "2.png", "2.png.mask.png", "3.mask.png"):
        photo(tmp_path / name)
    assert [path.name for path in photo_files(tmp_path, "card").paths] == ["1.jpg", "2.png", "3.mask.png"]


def test_a_folder_of_other_pictures_says_so(tmp_path: Path) -> None:
    (tmp_path / "1.dng").write_bytes(b"x")
    with pytest.raises(BadInput, match="holds no photo; 1 DNG in card: pictures of a kind that is not read"):
        photo_files(tmp_path, "card")
