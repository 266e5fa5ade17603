"""What an inspection gives of a flight that cannot be planned."""

from pathlib import Path

import pytest

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
