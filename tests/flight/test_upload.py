import time
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from schemas.mission import MissionItem, mission_items
from schemas.problem import BadInput
from tasks.flight.link import Link
from tasks.flight.upload import clear_mission, compare, read_back, upload_mission
from tasks.simulation.autopilot import Faults
from tasks.simulation.vehicle import start_vehicle
from tests.flight.wall_plan import wall_plan

PLAN = wall_plan(3, 1)
ITEMS = mission_items(PLAN)


def as_ardupilot_tells(item: MissionItem) -> MissionItem:
    """Another frame, no mount mode; home in place of item 0."""
    frame = 3 if item.frame == 6 else 0
    z = 0.0 if item.command == 205 else item.z
    x = item.x + 5 if item.seq == 0 else item.x
    return item.model_copy(update={"frame": frame, "z": z, "x": x, "photo": None})


TOLD = tuple(as_ardupilot_tells(i) for i in ITEMS)


def test_legitimate_differences_are_none() -> None:
    assert compare(ITEMS, TOLD) == []


@settings(max_examples=60)
@given(
    seq=st.integers(1, len(ITEMS) - 1),
    change=st.sampled_from(
        [("x", 1), ("y", -1), ("z", 0.05), ("param1", 1.0), ("param2", 1.0), ("command", 1)]
    ),
)
def test_any_other_difference_is_found(seq: int, change: tuple[str, float]) -> None:
    key, by = change
    item = TOLD[seq]
    places = (16, 21, 22)
    if (key == "z" and item.command not in places) or (key == "param2" and item.command in places):
        return
    changed = item.model_copy(update={key: (getattr(item, key) or 0) + by})
    found = compare(ITEMS, (*TOLD[:seq], changed, *TOLD[seq + 1 :]))
    assert len(found) == 1
    assert f"item {seq} " in found[0]


def test_a_missing_item_and_absolute_heights_are_found() -> None:
    assert compare(ITEMS, TOLD[:-1]) == [f"{len(ITEMS) - 1} items instead of {len(ITEMS)}"]
    absolute = TOLD[1].model_copy(update={"frame": 0})
    assert "heights" in compare(ITEMS, (TOLD[0], absolute, *TOLD[2:]))[0]


def test_uploads_over_a_link_that_loses_30_percent_each_way() -> None:
    with start_vehicle(PLAN, 1, Faults(loss=0.3)) as url, Link(url, 5.0) as link:
        link.find_vehicle()
        began = time.monotonic()
        upload_mission(link, ITEMS)
        assert time.monotonic() - began < 0.5 * len(ITEMS)  # 0.2 s an item on an idle machine
        assert compare(ITEMS, read_back(link)) == []


def test_uploads_or_leaves_nothing_behind() -> None:
    with start_vehicle(PLAN, 1) as url, Link(url, 5.0) as link:
        link.find_vehicle()
        began = time.monotonic()
        upload_mission(link, ITEMS)
        assert time.monotonic() - began < 3.0
        assert compare(ITEMS, read_back(link)) == []
        with pytest.raises(BadInput, match=r"no room for 1200 mission items.*Plan fewer"):
            upload_mission(link, tuple(ITEMS[1].model_copy(update={"seq": i}) for i in range(1200)))
        bad = ITEMS[6].model_copy(update={"x": 950_000_000})
        with pytest.raises(BadInput, match=r"refused mission item 6 \(invalid param5 x\)"):
            upload_mission(link, (*ITEMS[:6], bad, *ITEMS[7:]))
        assert read_back(link) == ()  # nothing half-uploaded stays
        assert clear_mission(link)


def test_an_interrupted_upload_leaves_nothing_behind() -> None:
    """ArduPilot refuses to clear a mission as long as it waits for the rest of one."""
    with start_vehicle(PLAN, 1) as url, Link(url, 5.0) as link:
        link.find_vehicle()

        def interrupt(message: Any) -> None:
            if message.get_type() == "MISSION_REQUEST" and message.seq == 5:
                link.on_message = None
                raise KeyboardInterrupt

        link.on_message = interrupt
        with pytest.raises(KeyboardInterrupt):
            upload_mission(link, ITEMS)
        assert read_back(link) == ()


def test_a_mission_that_reads_back_differently_is_cleared() -> None:
    with start_vehicle(PLAN, 1, Faults(lose_last_item=True)) as url, Link(url, 5.0) as link:
        link.find_vehicle()
        with pytest.raises(BadInput, match="another mission than was sent"):
            upload_mission(link, ITEMS)
        assert read_back(link) == ()
