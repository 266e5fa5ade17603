"""What an inspection gives of a flight that cannot be planned."""

from pathlib import Path

import pytest

from artifacts import store
from flows.collect_images import collect
from schemas.inspection import Inspection, PhotoSet
from schemas.problem import BadInput
from tests.flows.test_watch import picture
from tests.planning.structures import wall


def test_a_plan_that_lacks_the_camera_is_told(tmp_path: Path) -> None:
    (tmp_path / "photos").mkdir()
    picture(0).save(tmp_path / "photos" / "a.jpg")
    given = Inspection(
        name="x", flight="external", flight_log="flight.tlog", photos=(PhotoSet(folder="photos"),)
    )
    collected = collect(given, tmp_path, wall().structure, lambda plan: None)
    assert [left.item for left in collected.left_out] == ["flight", "flight_log"]
    assert all("the key 'camera' is missing" in left.what for left in collected.left_out)
    with pytest.raises(BadInput, match="a flight cannot be planned without one"):
        collect(given.model_copy(update={"photos": ()}), tmp_path, wall().structure, lambda plan: None)


def test_a_photo_that_cannot_be_read_is_left_out_by_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "photos").mkdir()
    for number, name in enumerate(("a.jpg", "locked.jpg")):
        picture(number).save(tmp_path / "photos" / name)
    digest = store.digest

    def refusing(path: Path) -> str:  # permissions do not stop root, who may run the tests
        if path.name in locked:
            raise PermissionError(13, "Permission denied")
        return digest(path)

    monkeypatch.setattr(store, "digest", refusing)
    given = Inspection(name="x", photos=(PhotoSet(folder="photos"),))
    with store.temporary():
        locked = {"locked.jpg"}
        collected = collect(given, tmp_path, None, lambda plan: None)
        assert [photo.name for photo in collected.photos] == ["a.jpg"]
        assert [(left.item, left.what) for left in collected.left_out] == [
            ("locked.jpg", "cannot be read (Permission denied)")
        ]
        locked = {"a.jpg", "locked.jpg"}
        with pytest.raises(BadInput, match=r"a\.jpg: cannot be read"):
            collect(given, tmp_path, None, lambda plan: None)
