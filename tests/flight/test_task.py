"""Whole flights on the simulated vehicle: client and vehicle are two processes on a real socket."""

import itertools
import pickle
import shutil
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from artifacts import store
from artifacts.flight_log import MAVLINK, ORIGINAL, messages
from schemas.flight_log import FlightLog
from schemas.flight_plan import FlightPlan
from schemas.mission import mission_items
from schemas.problem import BadInput
from tasks.flight.fly import AUTO, Flight
from tasks.flight.link import Link, LinkLost
from tasks.flight.parameters import read_parameters
from tasks.flight.recording import archive
from tasks.flight.task import FlightCutShort, convert, flight_pages, fly, import_log
from tasks.flight.upload import clear_mission, read_back
from tasks.simulation.autopilot import Faults
from tasks.simulation.trajectory import fly_mission
from tasks.simulation.vehicle import start_vehicle
from tests.development_data import development_data
from tests.flight.wall_plan import wall_plan

PLAN = wall_plan(4, 2)


def full(*_: Any) -> None:
    raise OSError(28, "No space left")


@pytest.fixture(scope="module")
def vehicle() -> Iterator[str]:
    with start_vehicle(PLAN, 3) as url:
        yield url


@pytest.fixture(scope="module")
def log(own_store: store.Store, vehicle: str) -> FlightLog:
    return fly.bare(PLAN, "1", vehicle, 10.0)


def test_flies_what_was_planned(log: FlightLog) -> None:
    """The log against the truth that photos are rendered from: the same function on the same mission."""
    true = fly_mission(mission_items(PLAN), PLAN.origin, PLAN.home_m, PLAN.vehicle, seed=3)
    assert log.vehicle == "ArduCopter simulated by Hairline"
    assert not log.missed
    assert [s.photo for s in log.shots] == [w.photo for w in PLAN.shooting_points]
    for shot, flown in zip(log.shots, true.shots, strict=True):
        assert shot.reported
        assert shot.pose.position_m == pytest.approx(flown.estimated_pose.position_m, abs=0.012)  # 1e-7°
        assert shot.pose.yaw_deg == pytest.approx(flown.estimated_pose.yaw_deg, abs=0.01)
        assert shot.time_s == pytest.approx(flown.time_s, abs=0.1)
    assert log.duration_s == pytest.approx(true.time_s[-1], abs=0.15)
    track = np.array([p.position_m for p in log.track])
    assert np.diff([p.time_s for p in log.track]).max() < 0.11
    assert track == pytest.approx(true.estimated_m[::5][: len(track)], abs=0.012)


def test_the_same_flight_has_the_same_archive(log: FlightLog, vehicle: str) -> None:
    assert fly.bare(PLAN, "2", vehicle, 10.0) == log


def test_a_vehicle_that_has_flown_takes_the_next_mission_at_once(log: FlightLog, vehicle: str) -> None:
    """ArduCopter stays in AUTO when it has landed, and refuses to clear a mission there."""
    with Link(vehicle, 5.0) as link:
        assert link.find_vehicle().custom_mode == AUTO
        assert not clear_mission(link)
        Flight(link, PLAN, mission_items(PLAN)).prepare()
        assert clear_mission(link)


def test_a_vehicle_that_refuses_to_start_keeps_no_mission(
    vehicle: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(mavlink, "MAV_CMD_MISSION_START", 4242)
    with pytest.raises(BadInput, match=r"does not start the mission|did not take off"):
        fly.bare(PLAN, "1", vehicle, 5.0)
    with Link(vehicle, 5.0) as link:
        link.find_vehicle()
        assert read_back(link) == ()


def test_the_archive_gives_the_flight_back(log: FlightLog) -> None:
    again = import_log.bare(log.archive, "flight.mcap", PLAN)
    assert again == log.model_copy(update={"way_home": ()})  # settings are no part of a flight


def test_a_truncated_archive_gives_what_it_has(log: FlightLog, tmp_path: Path) -> None:
    whole = store.current().path(log.archive).read_bytes()
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(whole[: int(len(whole) * 0.65)])
    part = import_log.bare(store.current().put(cut), "cut.mcap", PLAN)
    assert 0.4 * log.duration_s < part.duration_s < 0.75 * log.duration_s
    *before, last = part.shots  # the speed at the last rests on less of the track
    assert tuple(before) == log.shots[: len(before)]
    assert last.pose == log.shots[len(before)].pose
    assert {s.photo for s in part.shots} | set(part.missed) == {s.photo for s in log.shots}


def test_a_vehicle_that_refuses_to_arm_says_why_and_keeps_no_mission() -> None:
    with start_vehicle(PLAN, 1, Faults(refuse_arm=True)) as url:
        said = r"refuses to arm.*PreArm: Compass not calibrated; Arm: .* 34 deg\. Wait or reboot\."
        with pytest.raises(BadInput, match=said) as problem:
            fly.bare(PLAN, "1", url, 1.5)
        assert problem.value.item == url
        with Link(url, 5.0) as link:
            link.find_vehicle()
            assert read_back(link) == ()


def test_a_link_that_breaks_before_take_off_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    def breaks(link: Link, plan: FlightPlan) -> None:
        raise LinkLost

    monkeypatch.setattr("tasks.flight.fly.WayHome", breaks)
    with (
        start_vehicle(PLAN, 1) as url,
        pytest.raises(BadInput, match="not heard for 5 s, before it was armed"),
    ):
        fly.bare(PLAN, "1", url, 5.0)


def test_a_vehicle_just_switched_on_is_waited_for() -> None:
    with start_vehicle(PLAN, 3, Faults(settling=1)) as url:
        assert fly.bare(PLAN, "1", url, 3.0).shots


def test_a_vehicle_that_never_settles_says_why() -> None:
    settling = r"does not change to GUIDED.*requires position"
    with start_vehicle(PLAN, 3, Faults(settling=99)) as url, pytest.raises(BadInput, match=settling):
        fly.bare(PLAN, "1", url, 1.0)


def test_a_link_lost_in_flight_keeps_what_was_archived() -> None:
    lost = r"not heard for 1\.5 s, (29|30) s after arming"
    with start_vehicle(PLAN, 3, Faults(vanish_s=30.0)) as url, pytest.raises(BadInput, match=lost) as problem:
        fly.bare(PLAN, "1", url, 1.5)
    kept = Path(problem.value.remedy.split("kept in ")[1].split(";")[0])
    assert kept.is_file()
    part = import_log.bare(store.current().put(kept), "flight.mcap", PLAN)
    assert part.duration_s == pytest.approx(30.0, abs=0.3)
    assert part.shots
    assert part.missed


@pytest.mark.parametrize(
    ("cause", "told"),
    [
        (KeyboardInterrupt(), "interrupted"),
        (OSError(28, "No space left"), r"archived any more \(No space left\)"),
    ],
    ids=["interrupted", "disk full"],
)
def test_a_flight_not_followed_keeps_what_was_archived_and_says_that_the_vehicle_flies_on(
    cause: BaseException, told: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    archived = itertools.count()

    def interrupted(*args: Any) -> None:
        archive(*args)
        if next(archived) == 900:
            raise cause

    monkeypatch.setattr("tasks.flight.fly.archive", interrupted)
    flies_on = (
        rf"{told}, \d+ s after arming\. The vehicle flies its mission on.*take over.*"
        r"Its RTL_ALT is this flight's: set it back to 1500 once it has landed"
    )
    plan = PLAN.model_copy(update={"return_height_m": 8.5})
    with start_vehicle(plan, 3) as url, pytest.raises(FlightCutShort, match=flies_on) as problem:
        fly.bare(plan, "1", url, 5.0)
    part = import_log.bare(problem.value.archive, "flight.mcap", PLAN)
    assert part.shots
    assert part.missed
    assert str(pickle.loads(pickle.dumps(problem.value))) == str(problem.value)


def test_a_disk_that_is_nearly_full_is_told_before_the_vehicle_is_asked(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("tasks.flight.task.LEAST_FREE_BYTES", 10**18)
    with pytest.raises(BadInput, match=r"MB of disk left.*Free some disk") as problem:
        fly.bare(PLAN, "1", "udp:127.0.0.1:1", 1.0)
    assert problem.value.item == "udp:127.0.0.1:1"


def test_an_archive_that_cannot_be_opened_leaves_the_vehicle_as_it_was(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("tasks.flight.task.FlightArchive", full)
    plan = PLAN.model_copy(update={"return_height_m": 8.5})
    with start_vehicle(plan, 1) as url:
        with pytest.raises(BadInput, match=r"cannot be archived \(No space left\)"):
            fly.bare(plan, "1", url, 5.0)
        with Link(url, 5.0) as link:
            link.find_vehicle()
            assert read_back(link) == ()
            assert read_parameters(link, [("RTL_ALT",)])["RTL_ALT"].param_value == 1500.0


def test_a_disk_that_fills_before_take_off_leaves_the_vehicle_on_the_ground(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("tasks.flight.fly.archive", full)
    with start_vehicle(PLAN, 1) as url:
        with pytest.raises(BadInput, match=r"cannot be archived \(No space left\)"):
            fly.bare(PLAN, "1", url, 5.0)
        with Link(url, 5.0) as link:
            assert not link.find_vehicle().base_mode & mavlink.MAV_MODE_FLAG_SAFETY_ARMED
            assert read_back(link) == ()


def test_a_disk_that_fills_after_landing_costs_the_end_of_the_archive(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    told: list[str] = []
    monkeypatch.setattr("mcap.writer.Writer.finish", full)
    monkeypatch.setattr("tasks.flight.task.note", told.append)
    with start_vehicle(PLAN, 3) as url:
        log = fly.bare(PLAN, "1", url, 5.0)
    assert not log.missed
    assert "end of the flight's archive could not be written (No space left)" in told[-1]
    again = import_log.bare(log.archive, "flight.mcap", PLAN)
    assert again.shots == log.shots


def test_what_the_vehicle_warned_of_stands_beside_the_photos_that_lack() -> None:
    with start_vehicle(PLAN, 3, Faults(failsafe_s=30.0)) as url:
        cut = fly.bare(PLAN, "1", url, 5.0)
    assert cut.shots
    assert cut.missed
    assert cut.said == ("Battery 1 is low 13.20V used 2500 mAh",)
    again = import_log.bare(cut.archive, "flight.mcap", PLAN)
    assert again == cut.model_copy(update={"way_home": ()})
    assert "the vehicle said: Battery 1 is low" in (flight_pages({}, cut)[0].markdown or "")


def test_a_dashboard_that_hangs_or_fails_does_not_keep_the_flight_waiting(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    told: list[float] = []

    def dashboard(fraction: float) -> None:
        told.append(fraction)
        time.sleep(0.5)
        raise ConnectionError

    monkeypatch.setattr("tasks.flight.task.progress", dashboard)
    with start_vehicle(PLAN, 3) as url:
        assert not fly.bare(PLAN, "1", url, 5.0).missed
    assert 1 <= len(told) < len(PLAN.waypoints)


def test_a_silent_vehicle_is_named() -> None:
    with start_vehicle(PLAN, 1, Faults(silent=True)) as url:
        with pytest.raises(BadInput, match=r"no vehicle answered within 1 s.*powered") as problem:
            fly.bare(PLAN, "1", url, 1.0)
        assert problem.value.item == url


def moved(north_m: float) -> FlightPlan:
    """The plan with home so far south of where the vehicle stands; the vehicle keeps a clearance of 1 m."""
    latitude = PLAN.origin.latitude_deg - north_m / 110_946
    return PLAN.model_copy(update={"origin": PLAN.origin.model_copy(update={"latitude_deg": latitude})})


@pytest.mark.parametrize(("north_m", "told"), [(1.2, "1.2"), (15.0, "15.0"), (-362.0, "362.0")])
def test_a_vehicle_farther_from_home_than_the_clearance_does_not_arm(
    vehicle: str, north_m: float, told: str
) -> None:
    with pytest.raises(BadInput, match=rf"stands {told} m from the plan's home.* 1 m .*Carry it to -35\.36"):
        fly.bare(moved(north_m), "1", vehicle, 5.0)


def test_a_vehicle_whose_position_settles_elsewhere_before_it_arms_does_not_take_off() -> None:
    with start_vehicle(PLAN, 1, Faults(drift_m=2.5)) as url:
        with pytest.raises(BadInput, match=r"stands 2\.5 m from the plan's home"):
            fly.bare(PLAN, "1", url, 5.0)
        with Link(url, 5.0) as link:
            assert not link.find_vehicle().base_mode & mavlink.MAV_MODE_FLAG_SAFETY_ARMED


def test_a_vehicle_within_the_clearance_of_home_may_fly(vehicle: str) -> None:
    near = moved(0.9)
    with Link(vehicle, 5.0) as link:
        assert Flight(link, near, mission_items(near)).prepare().startswith("ArduCopter")


@pytest.mark.parametrize("home_off_m", [1.2, -8.0])
def test_a_vehicle_that_counts_heights_from_elsewhere_does_not_take_off(home_off_m: float) -> None:
    off = rf"counts its height as {-home_off_m} m.*and 1 m are allowed"
    with start_vehicle(PLAN, 1, Faults(home_off_m=home_off_m)) as url:
        with pytest.raises(BadInput, match=off):
            fly.bare(PLAN, "1", url, 5.0)
        with Link(url, 5.0) as link:
            heartbeat = link.find_vehicle()
            assert not heartbeat.base_mode & mavlink.MAV_MODE_FLAG_SAFETY_ARMED
            assert read_back(link) == ()


def test_heights_told_within_the_clearance_are_flown() -> None:
    with start_vehicle(PLAN, 1, Faults(home_off_m=0.5)) as url:
        assert fly.bare(PLAN, "1", url, 5.0).shots


# -- logs of others ------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "vehicle", "duration_s", "points"),
    [
        ("dronekit_flight.tlog", "ardupilotmega quadrotor", 575.53, 1573),
        ("pymavlink_test.BIN", "ArduPlane V3.8.2-dev (8178ab40)", 0.934, 9),
        ("pyulog_sample_log_small.ulg", "PX4 on CUBEPILOT_CUBEORANGE", 5.609, 27),
    ],
)
def test_real_logs(name: str, vehicle: str, duration_s: float, points: int, tmp_path: Path) -> None:
    path = development_data("logs") / name
    out = tmp_path / "out.mcap"
    convert(path, out)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["out.mcap"]
    log = import_log.bare(store.current().put(out), "out.mcap", None)
    assert log.vehicle == vehicle
    assert log.duration_s == pytest.approx(duration_s, abs=0.01)
    assert len(log.track) == points
    if name.endswith("tlog"):  # what is not in it is the radio's noise between frames
        assert len(original_of(out, name)) > 0.98 * path.stat().st_size
        assert path.read_bytes().startswith(original_of(out, name)[:100_000])
    else:
        assert original_of(out, name) == path.read_bytes()
        assert import_log.bare(store.current().put(path), name, None).track == log.track


def original_of(archive: Path, name: str) -> bytes:
    """The log that an archive was converted from."""
    if name.endswith("tlog"):
        frames = [(time_ns, raw) for topic, time_ns, raw in messages(archive) if topic == MAVLINK]
        return b"".join((time_ns // 1000).to_bytes(8, "big") + raw for time_ns, raw in frames)
    return b"".join(block for topic, _, block in messages(archive) if topic == ORIGINAL)


def test_logs_that_are_none(tmp_path: Path) -> None:
    contents = {
        "empty.tlog": b"",
        "words.tlog": b"These are no frames at all. " * 50,
        "noise.BIN": b"\xa3\x95" + bytes(range(256)) * 20,
        "broken.ulg": b"ULog\x01\x12\x35\x01" + b"\0" * 8 + b"\xff" * 200,
        "other.mcap": b"\x89MCAP0\r\n" + b"\xff" * 100,
    }
    for name, content in contents.items():
        path = tmp_path / name
        path.write_bytes(content)
        with pytest.raises(BadInput, match=name):
            import_log.bare(store.current().put(path), name, None)
    for name in ("empty.tlog", "words.tlog", "broken.ulg", "other.mcap"):
        with pytest.raises(BadInput, match=name):
            convert(tmp_path / name, tmp_path / "out.mcap")
    assert sorted(p.name for p in tmp_path.iterdir()) == sorted(contents)


def test_truncated_real_logs_give_what_they_have(tmp_path: Path) -> None:
    logs = development_data("logs")
    for name, share in (("dronekit_flight.tlog", 0.2), ("pymavlink_test.BIN", 0.9)):
        whole = (logs / name).read_bytes()
        cut = tmp_path / name
        cut.write_bytes(whole[: int(len(whole) * share)])
        assert import_log.bare(store.current().put(cut), name, None).track
    cut = tmp_path / "cut.ulg"
    shutil.copyfile(logs / "pyulog_sample_log_small.ulg", cut)
    cut.chmod(0o600)
    with cut.open("r+b") as stream:
        stream.truncate(cut.stat().st_size * 2 // 3)
    assert import_log.bare(store.current().put(cut), "cut.ulg", None).track
