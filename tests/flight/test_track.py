import numpy as np
import pytest

from schemas.mission import mission_items
from schemas.problem import BadInput
from tasks.flight.recording import Recording
from tasks.flight.track import compare_with_plan
from tasks.simulation.trajectory import Flown, fly_mission
from tests.flight.test_shots import BOOT_S, recorded
from tests.flight.wall_plan import wall_plan

PLAN = wall_plan(5, 2)


def flight(seed: int) -> Flown:
    return fly_mission(mission_items(PLAN), PLAN.origin, PLAN.home_m, PLAN.vehicle, seed)


def distance_m(points: np.ndarray, start: np.ndarray, end: np.ndarray) -> np.ndarray:
    along = end - start
    t = np.clip((points - start) @ along / max(float(along @ along), 1e-12), 0, 1)
    return np.asarray(np.linalg.norm(points - start - t[:, None] * along, axis=1))


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_errors_are_those_of_the_trajectory(seed: int) -> None:
    """Against the simulator's own record of when each waypoint was reached."""
    flown = flight(seed)
    errors = {e.what: e for e in compare_with_plan(recorded(PLAN, flown), PLAN, "log").errors}
    reached = [0.0, *(time for _, time in flown.reached)]
    corners = [np.array(PLAN.home_m), np.array([0.0, -10.0, 4.0])]
    corners += [np.array(w.position_m) for w in PLAN.waypoints]
    everything: dict[str, list[np.ndarray]] = {"flight": [], "wall": [], "soffit": []}
    for leg, way in enumerate(PLAN.waypoints, start=1):
        during = (flown.time_s >= reached[leg]) & (flown.time_s <= reached[leg + 1])
        gaps = distance_m(flown.estimated_m[during], corners[leg], corners[leg + 1])
        if len(gaps) < 100:
            continue
        everything["flight"].append(gaps)
        if way.surface:
            everything[way.surface].append(gaps)
            assert errors[f"leg {leg}"].rms_m == pytest.approx(np.sqrt((gaps**2).mean()), abs=0.015)
    for what, parts in everything.items():
        gaps = np.concatenate(parts)
        assert errors[what].rms_m == pytest.approx(np.sqrt((gaps**2).mean()), abs=0.003)
        assert errors[what].largest_m == pytest.approx(gaps.max(), abs=0.02)


def test_a_shifted_flight_is_off_by_its_shift() -> None:
    flown = flight(1)
    shifted = recorded(PLAN, flown)
    latitude_m = 0.7 / 110_946  # metres per degree here
    shifted.fixes = [
        type(f)(f.time_s, f.latitude_deg - latitude_m, f.longitude_deg, f.altitude_m, f.height_m, f.yaw_deg)
        for f in shifted.fixes
    ]
    errors = {e.what: e for e in compare_with_plan(shifted, PLAN, "log").errors}
    assert errors["leg 4"].rms_m == pytest.approx(0.7, abs=0.03)  # along the wall: the shift is all across


def test_times_count_from_arming_and_positions_from_the_origin() -> None:
    flown = flight(1)
    found = compare_with_plan(recorded(PLAN, flown), PLAN, "log")
    assert found.track[0].time_s == 0.0
    assert found.duration_s == pytest.approx(flown.time_s[-1])
    assert found.track[100].position_m == pytest.approx(tuple(flown.estimated_m[500]), abs=1e-6)


def test_fixes_on_the_ground_do_not_count() -> None:
    recording = recorded(PLAN, flight(1))
    recording.armed_s = [(BOOT_S + 10.0, BOOT_S + 20.0)]
    found = compare_with_plan(recording, PLAN, "log")
    assert found.duration_s == pytest.approx(10.0)
    assert 0.0 <= found.track[0].time_s <= found.track[-1].time_s <= 10.0


def test_a_log_without_positions_or_from_elsewhere_is_refused() -> None:
    with pytest.raises(BadInput, match="no position"):
        compare_with_plan(Recording(), PLAN, "empty.BIN")
    moved = PLAN.model_copy(update={"origin": PLAN.origin.model_copy(update={"latitude_deg": 10.0})})
    with pytest.raises(BadInput, match=r"old\.BIN: .* km from the plan"):
        compare_with_plan(recorded(PLAN, flight(1)), moved, "old.BIN")
