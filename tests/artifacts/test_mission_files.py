"""Mission files against themselves, against the samples of two ground stations, and against bad ones."""

import csv
import json
from pathlib import Path
from xml.etree import ElementTree
from zipfile import ZipFile

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pymavlink import mavwp

from artifacts.mission_files import (
    Mission,
    mission_of,
    read_plan,
    read_waypoints,
    write_missions,
    write_plan,
    write_waypoints,
)
from schemas.box import Box
from schemas.camera import Camera
from schemas.flight_plan import FlightPlan, Waypoint
from schemas.geodesy import GeoOrigin
from schemas.mission import MissionItem, mission_items
from schemas.problem import BadInput
from schemas.vehicle import Vehicle
from tests.development_data import development_data

ORIGIN = GeoOrigin(latitude_deg=-35.363261, longitude_deg=149.165230, altitude_m=584.0)


def a_plan() -> FlightPlan:
    waypoints = (
        Waypoint(kind="intermediate", position_m=(3.0, -2.0, 4.0), yaw_deg=0.0),
        Waypoint(
            kind="shooting", position_m=(3.1234, -8.5, 4.5), yaw_deg=359.9, pitch_deg=-12.5,
            surface="wall-01", photo="wall-01-0001",
        ),
        Waypoint(kind="intermediate", position_m=(3.0, -2.0, 4.0), yaw_deg=0.0),
    )  # fmt: skip
    return FlightPlan(
        camera=Camera(width_px=1632, height_px=1224, focal_px=4000), vehicle=Vehicle(), origin=ORIGIN,
        home_m=(3.0, -2.0, 0.5), waypoints=waypoints, coverage=(), length_m=1.0, duration_s=1.0, overlap=0.5,
    )  # fmt: skip


@pytest.mark.parametrize(
    ("write", "read", "name"),
    [(write_waypoints, read_waypoints, "m.waypoints"), (write_plan, read_plan, "m.plan")],
)
def test_a_plan_comes_back_item_by_item(write, read, name: str, tmp_path: Path) -> None:  # type: ignore[no-untyped-def]
    plan = a_plan()
    write(plan, tmp_path / name)
    back = read(tmp_path / name)
    items = mission_items(plan)[1:]
    assert len(back.items) == len(items)
    for item, written in zip(back.items, items, strict=True):
        assert item == written.model_copy(update={"photo": None})
    assert back.home == pytest.approx(ORIGIN.to_geographic(plan.home_m), abs=1e-7)


def test_every_mission_flies_at_the_planned_speed(tmp_path: Path) -> None:
    """Commanded before it leaves the place above home, but not right after take-off, where Copter 4.1 to 4.4
    forgets it: ArduPilot's own speed is 10 m/s."""
    plan = a_plan().model_copy(update={"vehicle": Vehicle(speed_m_s=1.5)})
    write_missions(plan, tmp_path / "mission")
    for mission in (read_waypoints(tmp_path / "mission.waypoints"), read_plan(tmp_path / "mission.plan")):
        take_off, _yaw, above, speed = mission.items[:4]
        assert [i.command for i in mission.items[:4]] == [22, 115, 16, 178]
        assert (above.x, above.y, above.z) == (take_off.x, take_off.y, take_off.z)
        assert (speed.param1, speed.param2) == (1.0, 1.5)  # over the ground, m/s
    assert read_plan(tmp_path / "mission.plan").speed_m_s == 1.5
    with ZipFile(tmp_path / "mission.kmz") as archive:
        waylines = ElementTree.fromstring(archive.read("wpmz/waylines.wpml"))
    assert waylines.findtext(".//w:autoFlightSpeed", "", WPML) == "1.5"


WPML = {"k": "http://www.opengis.net/kml/2.2", "w": "http://www.dji.com/wpmz/1.0.2"}


def test_the_dji_mission_carries_every_waypoint_and_its_photo(tmp_path: Path) -> None:
    plan = a_plan()
    write_missions(plan, tmp_path / "mission")
    with ZipFile(tmp_path / "mission.kmz") as archive:
        assert archive.namelist() == ["wpmz/template.kml", "wpmz/waylines.wpml"]
        template, waylines = (ElementTree.fromstring(archive.read(name)) for name in archive.namelist())
    for root in (template, waylines):
        placemarks = root.findall(".//k:Placemark", WPML)
        assert len(placemarks) == len(plan.waypoints)
        for placemark, waypoint in zip(placemarks, plan.waypoints, strict=True):
            longitude, latitude = map(float, placemark.findtext(".//k:coordinates", "", WPML).split(","))
            expected = plan.origin.to_geographic(waypoint.position_m)
            assert (latitude, longitude) == pytest.approx(expected[:2], abs=1e-8)
            height = placemark.findtext("w:executeHeight", None, WPML) or placemark.findtext(
                "w:height", "", WPML
            )
            assert float(height) == pytest.approx(waypoint.position_m[2] - plan.home_m[2], abs=1e-3)
            assert placemark.findtext("w:waypointTurnParam/w:waypointTurnMode", "", WPML).startswith(
                "toPointAndStop"
            )
            does = [a.text for a in placemark.findall(".//w:actionActuatorFunc", WPML)]
            shoots = ["gimbalRotate", "rotateYaw", "hover", "takePhoto"]
            assert does == (shoots if waypoint.kind == "shooting" else [])
    (shot,) = waylines.findall(".//w:actionGroup/..", WPML)
    assert float(shot.findtext(".//w:gimbalPitchRotateAngle", "", WPML)) == -12.5
    assert float(shot.findtext(".//w:aircraftHeading", "", WPML)) == pytest.approx(-0.1)  # 359.9°
    assert shot.findtext(".//w:fileSuffix", "", WPML) == "wall-01-0001"
    assert waylines.findtext(".//w:finishAction", "", WPML) == "autoLand"
    again = tmp_path / "again"
    write_missions(plan, again)
    assert (tmp_path / "again.kmz").read_bytes() == (tmp_path / "mission.kmz").read_bytes()


def test_kml_and_csv_carry_every_position(tmp_path: Path) -> None:
    plan = a_plan()
    write_missions(plan, tmp_path / "mission")
    places = [plan.origin.to_geographic(w.position_m) for w in plan.waypoints]
    root = ElementTree.parse(tmp_path / "mission.kml").getroot()
    path = root.findtext(".//k:LineString/k:coordinates", "", WPML).split()
    home = plan.origin.to_geographic(plan.home_m)
    for text, (latitude, longitude, altitude) in zip(path, [home, *places, home], strict=True):
        assert [float(x) for x in text.split(",")] == pytest.approx([longitude, latitude, altitude], abs=6e-4)
        assert float(text.split(",")[0]) == pytest.approx(longitude, abs=1e-8)
    assert root.findtext(".//k:Placemark[2]/k:name", "", WPML) == "wall-01-0001"
    with (tmp_path / "mission.csv").open() as stream:
        rows = list(csv.DictReader(stream))
    for row, waypoint, (latitude, longitude, _) in zip(rows, plan.waypoints, places, strict=True):
        assert float(row["latitude_deg"]) == pytest.approx(latitude, abs=1e-8)
        assert float(row["longitude_deg"]) == pytest.approx(longitude, abs=1e-8)
        assert (row["kind"], row["photo"]) == (waypoint.kind, waypoint.photo or "")


def test_the_fence_and_a_rally_point_go_into_the_plan(tmp_path: Path) -> None:
    fence = ((-20.0, -20.0), (20.0, -20.0), (20.0, 20.0))
    aside = Box(low_m=(10.0, -15.0, 0.0), high_m=(15.0, -12.0, 5.0))
    flown_over = Box(low_m=(2.0, -7.0, 0.0), high_m=(5.0, -6.0, 2.0))
    plan = a_plan().model_copy(update={"fence_m": fence, "no_fly_m": (aside, flown_over)})
    write_plan(plan, tmp_path / "m.plan")
    back = read_plan(tmp_path / "m.plan")
    stays, leaves = back.fences["polygons"]
    assert (stays["inclusion"], leaves["inclusion"]) == (True, False)
    assert len(leaves["polygon"]) == 4
    for corner, place in zip(stays["polygon"], fence, strict=True):
        assert ORIGIN.to_enu(*corner, ORIGIN.altitude_m)[:2] == pytest.approx(place, abs=1e-3)
    (rally,) = back.rally_points["points"]
    assert rally[:2] == pytest.approx(ORIGIN.to_geographic(plan.waypoints[0].position_m)[:2], abs=1e-8)
    assert rally[2] == 3.5


def test_waypoints_carry_eight_decimals(tmp_path: Path) -> None:
    write_waypoints(a_plan(), tmp_path / "m.waypoints")
    lines = (tmp_path / "m.waypoints").read_text().splitlines()
    assert lines[0] == "QGC WPL 110"
    assert all(len(line.split("\t")) == 12 for line in lines[1:])
    assert all(len(line.split("\t")[8].split(".")[1]) >= 8 for line in lines[1:])


def test_pymavlink_reads_what_we_write(tmp_path: Path) -> None:
    plan = a_plan()
    write_waypoints(plan, tmp_path / "m.waypoints")
    loader = mavwp.MAVWPLoader()
    assert loader.load(str(tmp_path / "m.waypoints")) == len(mission_items(plan))
    for read, item in zip(loader.wpoints[1:], mission_items(plan)[1:], strict=True):
        assert read.command == item.command
        if item.frame == 6:
            assert (read.x * 1e7, read.y * 1e7, read.z) == pytest.approx((item.x, item.y, item.z), abs=0.1)


NUMBERS = st.none() | st.floats(-1e6, 1e6, width=32)


@settings(max_examples=60)
@given(
    st.lists(
        st.builds(
            MissionItem, seq=st.integers(1, 5000), frame=st.just(6), command=st.sampled_from([16, 21, 82]),
            param1=NUMBERS, param2=NUMBERS, param3=NUMBERS, param4=NUMBERS,
            x=st.integers(-900_000_000, 900_000_000), y=st.integers(-1_800_000_000, 1_800_000_000),
            z=st.floats(-500, 9000),
        )
        | st.builds(
            MissionItem, seq=st.integers(1, 5000), frame=st.just(2), command=st.sampled_from([115, 177, 203]),
            param1=NUMBERS, x=st.integers(-1000, 1000), y=st.integers(-1000, 1000), z=st.floats(-10, 10),
        ),
        max_size=8,
    )
)  # fmt: skip
def test_any_mission_survives_both_formats(
    tmp_path_factory: pytest.TempPathFactory, items: list[MissionItem]
) -> None:
    mission = Mission(home=(47.0, 8.0, 400.0), items=tuple(items))
    folder = tmp_path_factory.mktemp("missions")
    write_waypoints(mission, folder / "m.waypoints")
    write_plan(mission, folder / "m.plan")
    assert read_waypoints(folder / "m.waypoints") == mission
    assert read_plan(folder / "m.plan") == mission


@pytest.mark.parametrize("name", ["copter_mission.txt", "indoor_mission.waypoints"])
def test_samples_of_ardupilot_keep_every_number(name: str, tmp_path: Path) -> None:
    sample = development_data("missions") / name
    write_waypoints(read_waypoints(sample), tmp_path / name)
    before, after = (
        [[float(x) for x in line.split()] for line in path.read_text().splitlines()[1:] if line.strip()]
        for path in (sample, tmp_path / name)
    )
    assert len(after) == len(before)
    for old, new in zip(before, after, strict=True):
        assert new == pytest.approx(old, abs=1e-7)


def test_a_sample_of_qgroundcontrol_keeps_its_meaning(tmp_path: Path) -> None:
    sample = development_data("missions") / "mission_test_sitl.plan"
    write_plan(read_plan(sample), tmp_path / "m.plan")
    before, after = (json.loads(path.read_text()) for path in (sample, tmp_path / "m.plan"))
    for old, new in zip(before["mission"].pop("items"), after["mission"].pop("items"), strict=True):
        for key in ("autoContinue", "command", "doJumpId", "frame", "type"):
            assert new[key] == old[key]
        assert [p is None for p in new["params"]] == [p is None for p in old["params"]]
        numbers = [[p or 0.0 for p in item["params"]] for item in (new, old)]
        assert numbers[0] == pytest.approx(numbers[1], abs=1e-7)
    assert after == before  # home, speeds, vehicle, fences, rally points


HOME = "QGC WPL 110\n0 1 0 16 0 0 0 0 47 8 400 1\n"


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("", "first line"),
        ("hello\n", "first line"),
        ("QGC WPL 110\n", "no items"),
        (HOME + "1 0 3 16 0 0 0\n", "line 3"),
        (HOME + "1 0 3 16 0 0 0 x 47 8 4 1\n", "line 3"),
        (HOME + "1 0 3 16 0 0 0 0 95 8 4 1\n", "no place"),
        (HOME + "1 0 3 16 0 0 0 0 7 8 nan 1\n", "altitude"),
        (HOME + "1 0 3 16 0 0 0 0 7 8 inf 1\n", "number"),
        (HOME + "1 0 3 16 0 0 0 0 7 8 5 0\n", "pilot"),
        (HOME + "1 0 2 203 0 0 0 0 0.5 0 0 1\n", "fraction"),
    ],
)
def test_a_bad_waypoints_file_is_refused_by_name_and_line(text: str, why: str, tmp_path: Path) -> None:
    (tmp_path / "bad.waypoints").write_text(text)
    with pytest.raises(BadInput, match=why) as problem:
        read_waypoints(tmp_path / "bad.waypoints")
    assert problem.value.item == "bad.waypoints"


@pytest.mark.parametrize("text", ["", "[]", "{}", '{"mission": {"items": [1]}}', '{"mission": null}', "\xff"])
def test_a_bad_plan_file_is_refused(text: str, tmp_path: Path) -> None:
    (tmp_path / "bad.plan").write_bytes(text.encode("latin-1"))
    with pytest.raises(BadInput) as problem:
        read_plan(tmp_path / "bad.plan")
    assert problem.value.item == "bad.plan"


def test_a_pattern_of_qgroundcontrol_is_refused(tmp_path: Path) -> None:
    write_plan(mission_of(a_plan()), tmp_path / "m.plan")
    content = json.loads((tmp_path / "m.plan").read_text())
    content["mission"]["items"][0] = {"type": "ComplexItem", "complexItemType": "survey"}
    (tmp_path / "m.plan").write_text(json.dumps(content))
    with pytest.raises(BadInput, match="item 1 is a pattern"):
        read_plan(tmp_path / "m.plan")
