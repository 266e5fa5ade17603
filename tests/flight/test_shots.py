import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from schemas.flight_plan import FlightPlan
from schemas.mission import mission_items
from tasks.flight.place import Place
from tasks.flight.recording import Fix, Recording, Trigger
from tasks.flight.shots import match_shots, unnamed_shots
from tasks.flight.track import compare_with_plan, with_velocity
from tasks.simulation.trajectory import Flown, fly_mission
from tests.flight.wall_plan import wall_plan

PLAN = wall_plan(6, 3)
BOOT_S = 20.0


def fix_at(plan: FlightPlan, time_s: float, position_m: tuple[float, float, float], yaw_deg: float) -> Fix:
    latitude, longitude, altitude = plan.origin.to_geographic(position_m)
    height = position_m[2] - plan.home_m[2]
    return Fix(BOOT_S + time_s, latitude, longitude, altitude, height, yaw_deg % 360.0)


def recorded(plan: FlightPlan, flown: Flown, counted: bool = True) -> Recording:
    recording = Recording("test")
    for k in range(0, len(flown.time_s), 5):
        x, y, z = flown.estimated_m[k]
        recording.fixes.append(fix_at(plan, flown.time_s[k], (x, y, z), flown.estimated_yaw_deg[k]))
    for index, shot in enumerate(flown.shots):
        pose = shot.estimated_pose
        fix = fix_at(plan, shot.time_s, pose.position_m, pose.yaw_deg)
        recording.triggers.append(Trigger(fix, 0.0, index if counted else None))
    recording.armed_s = [(BOOT_S, BOOT_S + float(flown.time_s[-1]))]
    return recording


def flight(plan: FlightPlan) -> Flown:
    return fly_mission(mission_items(plan), plan.origin, plan.home_m, plan.vehicle, seed=5)


FLOWN = flight(PLAN)
NAMES = [w.photo for w in PLAN.shooting_points]


def test_every_shot_gets_its_photo_pose_and_time() -> None:
    shots = compare_with_plan(recorded(PLAN, FLOWN), PLAN, "log").shots
    assert [s.photo for s in shots] == NAMES
    for shot, true, way in zip(shots, FLOWN.shots, PLAN.shooting_points, strict=True):
        assert shot.pose.position_m == pytest.approx(true.estimated_pose.position_m, abs=1e-6)
        assert shot.pose.yaw_deg == pytest.approx(true.estimated_pose.yaw_deg)
        assert (shot.pose.pitch_deg, shot.surface) == (way.pitch_deg, way.surface)
        assert shot.time_s == pytest.approx(true.time_s, abs=1e-3)
        assert shot.reported


def test_speed_at_a_shot_is_that_of_the_track() -> None:
    """Fixes five times a second, a centimetre off; none around the last shot."""
    shots = compare_with_plan(recorded(PLAN, FLOWN), PLAN, "log").shots[:2]
    time_s = np.arange(0.0, 60.0, 0.2)
    at_m = np.column_stack([np.sin(time_s / 2), 0.3 * time_s, 0.0 * time_s])
    at_m += np.random.default_rng(3).normal(0.0, 0.01, at_m.shape)
    known = [shot.model_copy(update={"time_s": t}) for shot, t in zip(shots, (10.03, 70.0), strict=True)]
    moving, unknown = with_velocity(known, time_s, at_m)
    assert moving.velocity_m_s == pytest.approx((np.cos(5.015) / 2, 0.3, 0.0), abs=0.03)
    assert unknown.velocity_m_s is None


@settings(max_examples=25)
@given(lost=st.sets(st.integers(0, len(NAMES) - 1)), counted=st.booleans())
def test_lost_messages_are_filled_in_from_the_track(lost: set[int], counted: bool) -> None:
    recording = recorded(PLAN, FLOWN, counted)
    recording.triggers = [t for i, t in enumerate(recording.triggers) if i not in lost]
    found = compare_with_plan(recording, PLAN, "log")
    assert [s.photo for s in found.shots] == NAMES
    assert not found.missed
    for i, (shot, true) in enumerate(zip(found.shots, FLOWN.shots, strict=True)):
        assert shot.reported == (i not in lost)
        off_m = np.linalg.norm(np.subtract(shot.pose.position_m, true.estimated_pose.position_m))
        assert off_m < 0.15
        assert abs((shot.pose.yaw_deg - true.estimated_pose.yaw_deg + 180) % 360 - 180) < 3.0


def test_a_photo_the_vehicle_never_counted_is_missed() -> None:
    recording = recorded(PLAN, FLOWN)
    del recording.triggers[7]
    recording.triggers = [Trigger(t.fix, t.pitch_deg, i) for i, t in enumerate(recording.triggers)]
    found = compare_with_plan(recording, PLAN, "log")
    assert found.missed == (NAMES[7],)
    assert [s.photo for s in found.shots] == [n for n in NAMES if n != NAMES[7]]


def test_a_flight_broken_off_misses_the_rest() -> None:
    recording = recorded(PLAN, FLOWN)
    end = BOOT_S + FLOWN.shots[9].time_s + 0.3
    recording.fixes = [f for f in recording.fixes if f.time_s <= end]
    recording.triggers = [t for t in recording.triggers if t.fix.time_s <= end]
    recording.armed_s = [(BOOT_S, end)]
    found = compare_with_plan(recording, PLAN, "log")
    assert [s.photo for s in found.shots] == NAMES[:10]
    assert found.missed == tuple(NAMES[10:])


def test_extra_shots_do_not_shift_the_others() -> None:
    recording = recorded(PLAN, FLOWN)
    stray = fix_at(PLAN, 3.0, (5.0, -12.0, 9.0), 0.0)
    recording.triggers.insert(0, Trigger(stray, 0.0, None))
    found = compare_with_plan(recording, PLAN, "log")
    assert [s.photo for s in found.shots] == NAMES
    assert found.shots[0].pose.position_m == pytest.approx(FLOWN.shots[0].estimated_pose.position_m, abs=1e-6)


def test_without_a_plan_shots_are_numbered() -> None:
    recording = recorded(PLAN, FLOWN)
    shots = unnamed_shots(recording.triggers, BOOT_S, Place.of_plan(PLAN))
    assert [s.photo for s in shots[:2]] == ["shot-0001", "shot-0002"]
    assert match_shots((), recording.triggers, Place.of_plan(PLAN)) == {}
