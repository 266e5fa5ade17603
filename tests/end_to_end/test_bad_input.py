"""Nothing usable: exit code 2, one clear message that names the file or key, no traceback."""

from pathlib import Path

import pytest

from artifacts.flight_log import messages
from tasks.simulation.autopilot import Faults
from tasks.simulation.vehicle import start_vehicle
from tests.end_to_end.commands import hairline
from tests.flight.wall_plan import wall_plan
from tests.small_inspection import write_inspection


@pytest.mark.parametrize(
    ("words", "named"),
    [
        (["run", "none.yaml"], "none.yaml: no such file"),
        (["register", "text.ply", "--out", "out"], "text.ply: "),
        (["register", "none.ply", "--out", "out"], "none.ply: no such file"),
        (["surfaces", "text.ply", "--out", "out"], "text.ply: "),
        (["plan", "text.json", "--camera", "camera.yaml", "--out", "out"], "text.json: "),
        (["stitch", "empty", "--out", "out"], "empty: holds no photo"),
        (["detect", "text.jpg", "--out", "out"], "text.jpg: "),
        (["detect", "nowhere", "--out", "out"], "nowhere: no such file or folder"),
        (["convert-log", "text.tlog", "--out", "out.mcap"], "text.tlog: "),
        (["init", "empty"], "empty: holds neither scans nor photos"),
        (["evaluate", "empty", "empty", "--out", "out"], "empty: holds no photo"),
    ],
)
def test_one_message_names_what_is_wrong(tmp_path: Path, words: list[str], named: str) -> None:
    (tmp_path / "empty").mkdir()
    for name in ("text.ply", "text.json", "text.jpg", "text.tlog"):
        (tmp_path / name).write_text("this is only text\n")
    result = hairline(*words, cwd=tmp_path, expect=2)
    assert f"Error: {named}" in result.stderr
    assert len(result.stderr.strip().splitlines()) == 1


def test_a_vehicle_that_never_answers_is_told_in_time(tmp_path: Path) -> None:
    plan = tmp_path / "plan.json"
    plan.write_text(_tiny_plan())
    words = ("fly", "plan.json", "--connection", "udpin:127.0.0.1:14999", "--timeout-s", "2", "--out", "out")
    result = hairline(*words, cwd=tmp_path, expect=2, timeout_s=60)
    assert "14999" in result.stderr


def test_what_was_received_of_a_flight_outlives_the_command(tmp_path: Path) -> None:
    plan = wall_plan(2, 1)
    (tmp_path / "plan.json").write_text(plan.model_dump_json())
    with start_vehicle(plan, 3, Faults(vanish_s=20.0)) as url:
        words = ("fly", "plan.json", "--connection", url, "--timeout-s", "2", "--out", "out")
        result = hairline(*words, cwd=tmp_path, expect=2, timeout_s=120)
    said = " ".join(result.stderr.split())
    assert "kept in out/flight.mcap" in said
    assert next(messages(tmp_path / "out" / "flight.mcap"))[0]


def test_photos_that_a_failsafe_left_out_are_told_with_what_the_vehicle_said(tmp_path: Path) -> None:
    plan = wall_plan(4, 2)
    (tmp_path / "plan.json").write_text(plan.model_dump_json())
    with start_vehicle(plan, 3, Faults(failsafe_s=20.0)) as url:
        words = ("fly", "plan.json", "--connection", url, "--out", "out")
        result = hairline(*words, cwd=tmp_path, timeout_s=120)
    said = " ".join(result.stderr.split())
    assert "planned photos were not shot" in said
    assert "the vehicle said: Battery 1 is low" in said


def test_an_unknown_key_is_told_before_anything_starts(tmp_path: Path) -> None:
    path = write_inspection(tmp_path / "site", photos=1)
    path.write_text(path.read_text() + "detects: {}\n")
    result = hairline("run", "site/inspection.yaml", cwd=tmp_path, expect=2)
    assert "unknown key 'detects'" in result.stderr
    assert not (tmp_path / "runs").exists()


def test_an_unknown_option_is_told(tmp_path: Path) -> None:
    result = hairline("run", "x.yaml", "--nonsense", cwd=tmp_path, expect=2)
    assert "--nonsense" in result.stdout + result.stderr


def _tiny_plan() -> str:
    from schemas.camera import Camera
    from schemas.flight_plan import FlightPlan, Waypoint
    from schemas.geodesy import GeoOrigin
    from schemas.vehicle import Vehicle

    return FlightPlan(
        camera=Camera(width_px=100, height_px=100, focal_px=100),
        vehicle=Vehicle(),
        origin=GeoOrigin(latitude_deg=0, longitude_deg=0),
        home_m=(0, 0, 0),
        waypoints=(Waypoint(kind="shooting", position_m=(0, 5, 5), yaw_deg=0, surface="w", photo="w-0001"),),
        coverage=(),
        length_m=20,
        duration_s=30,
        overlap=0.5,
    ).model_dump_json()
