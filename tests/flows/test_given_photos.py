"""The photos in an inspection's folders: what they are called, and which shot of a flight took each."""

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from artifacts import store
from flows.given_photos import PhotoSource, given_photos
from schemas.flight_log import FlightLog
from schemas.inspection import Inspection, PhotoSet
from tasks.photos.task import assign
from tests.photos.test_assignment import log_of


@pytest.fixture(autouse=True)
def own_store() -> object:
    with store.temporary():
        yield


def photo(path: Path, grey: int, taken: str | None = None) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    exif = Image.Exif()
    if taken is not None:
        exif.get_ifd(0x8769)[0x9003] = taken
    Image.fromarray(np.full((40, 60, 3), grey, np.uint8)).save(path, exif=exif)


def given(base: Path, *sets: PhotoSet, log: FlightLog | None = None) -> list[PhotoSource]:
    return given_photos(Inspection(name="two-cards", photos=sets), base, log)[0]


def test_photos_of_two_cards_are_told_apart_by_their_folders(tmp_path: Path) -> None:
    for k, name in enumerate(["card1/DJI_0001.png", "card1/DJI_0002.png", "card2/DJI_0001.png"]):
        photo(tmp_path / name, 60 * k)
    sources = given(
        tmp_path, PhotoSet(folder="card1", surface="deck"), PhotoSet(folder="card2", surface="deck")
    )
    assert [s.name for s in sources] == ["card1/DJI_0001.png", "DJI_0002.png", "card2/DJI_0001.png"]
    assert {s.surface for s in sources} == {"deck"}
    assert len({s.file.sha256 for s in sources}) == 3


def test_folders_called_alike_are_told_apart_by_the_folders_around_them(tmp_path: Path) -> None:
    for k, name in enumerate(["flight1/100MEDIA/1.png", "flight2/100MEDIA/1.png"]):
        photo(tmp_path / name, 60 * k)
    sources = given(tmp_path, PhotoSet(folder="flight1/100MEDIA"), PhotoSet(folder="flight2/100MEDIA"))
    assert [s.name for s in sources] == ["flight1/100MEDIA/1.png", "flight2/100MEDIA/1.png"]


def test_one_folder_needs_no_name(tmp_path: Path) -> None:
    photo(tmp_path / "photos/1.png", 60)
    assert [s.name for s in given(tmp_path, PhotoSet(folder="photos"))] == ["1.png"]


def test_a_flight_on_two_cards_is_one_flight_in_the_order_of_the_clock(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The camera's counter starts anew on the second card, whose name comes first."""
    monkeypatch.setattr("flows.given_photos.assign", assign.bare)  # without Prefect's server
    for k, name in enumerate(["b/DJI_9998.jpg", "b/DJI_9999.jpg", "a/DJI_0001.jpg", "a/DJI_9998.jpg"]):
        photo(tmp_path / name, 60 * k, f"2026:05:01 12:00:0{k}")
    log = log_of(("w", 1), ("x", 2), ("y", 3), ("z", 4))
    sources = given(tmp_path, PhotoSet(folder="a"), PhotoSet(folder="b"), log=log)
    east_m = {s.name: s.pose.position_m[0] for s in sources if s.pose}
    assert east_m == {"b/DJI_9998.jpg": 1, "DJI_9999.jpg": 2, "DJI_0001.jpg": 3, "a/DJI_9998.jpg": 4}
    assert {s.surface for s in sources} == {"wall"}


def test_bitmaps_are_photos_too(tmp_path: Path) -> None:
    photo(tmp_path / "photos/1.BMP", 60)
    assert [s.name for s in given(tmp_path, PhotoSet(folder="photos"))] == ["1.BMP"]


def test_a_link_to_nothing_is_named(tmp_path: Path) -> None:
    photo(tmp_path / "photos/1.png", 60)
    (tmp_path / "photos/2.jpg").symlink_to("/card/DCIM/2.jpg")
    (tmp_path / "photos/3.jpg").mkdir()
    inspection = Inspection(name="wall", photos=(PhotoSet(folder="photos"),))
    sources, left_out = given_photos(inspection, tmp_path, None)
    assert [s.name for s in sources] == ["1.png"]
    assert [(one.item, one.what) for one in left_out] == [
        ("2.jpg", "cannot be read (No such file or directory)")
    ]
