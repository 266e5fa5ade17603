"""Whole plans: clearance and coverage checked from outside, and what is refused."""

from itertools import pairwise

import numpy as np
import numpy.typing as npt
import pytest
from scipy.spatial import cKDTree

from schemas.contract import Vector3
from schemas.flight_plan import FlightPlan
from schemas.mission import MOST_ITEMS, mission_items
from schemas.problem import BadInput
from schemas.settings import PlanSettings
from schemas.vehicle import Vehicle
from tasks.planning.plan import plan_and_prove
from tests.planning.structures import CAMERA, OPEN, ORIGIN, VEHICLE, World, box, bridge, rectangle, wall

SETTINGS = PlanSettings(gsd_mm_px=1.0, overlap=0.5, free_m=(OPEN,))
OF_THE_DEMO = SETTINGS.model_copy(update={"surfaces": ("web-01", "pier-01", "soffit-01")})


def planned(
    world: World,
    settings: PlanSettings = SETTINGS,
    vehicle: Vehicle = VEHICLE,
    home_m: Vector3 | None = None,
) -> FlightPlan:
    return plan_and_prove(world.structure, world.cloud, CAMERA, vehicle, ORIGIN, home_m, settings)[0]


def nearest_m(made: FlightPlan, points: npt.NDArray[np.float64]) -> float:
    """Least distance of any point of the path to the raw points, sampled every centimetre."""
    places = np.array([w.position_m for w in made.waypoints])
    samples = [
        a + np.linspace(0, 1, max(2, int(np.linalg.norm(b - a) / 0.01)))[:, None] * (b - a)
        for a, b in pairwise(places)
    ]
    return float(
        cKDTree(points, leafsize=256).query(np.concatenate(samples), distance_upper_bound=4.0)[0].min()
    )


@pytest.fixture(scope="module")
def of_the_demo() -> FlightPlan:
    return planned(bridge(), OF_THE_DEMO)


def test_the_demo_bridge_is_seen_whole_with_few_photos(of_the_demo: FlightPlan) -> None:
    assert {c.surface for c in of_the_demo.coverage} == {"web-01", "pier-01", "soffit-01"}
    assert all(c.covered >= 0.995 for c in of_the_demo.coverage)
    farthest_m = of_the_demo.coverage[0].stand_off_m + VEHICLE.position_error_m
    assert CAMERA.gsd_mm_px(farthest_m) == pytest.approx(1.0, rel=1e-4)
    assert all(c.reachable >= 0.995 and c.twice >= 0.995 for c in of_the_demo.coverage)
    assert all(c.twice_median >= 0.99 and c.twice_p05 >= 0.97 for c in of_the_demo.coverage)
    assert len(of_the_demo.shooting_points) <= 160


def test_the_demo_flight_keeps_its_clearance(of_the_demo: FlightPlan) -> None:
    assert nearest_m(of_the_demo, bridge().cloud) >= VEHICLE.inflation_m


def test_photos_are_numbered_in_flying_order(of_the_demo: FlightPlan) -> None:
    names = [w.photo for w in of_the_demo.shooting_points if w.surface == "soffit-01"]
    assert names == [f"soffit-01-{k:04d}" for k in range(1, len(names) + 1)]
    assert len({w.photo for w in of_the_demo.shooting_points}) == len(of_the_demo.shooting_points)


def test_it_takes_off_and_lands_above_home(of_the_demo: FlightPlan) -> None:
    first, last = of_the_demo.waypoints[0], of_the_demo.waypoints[-1]
    assert first.position_m == last.position_m
    assert first.position_m[:2] == of_the_demo.home_m[:2]
    assert first.position_m[2] >= of_the_demo.home_m[2] + 2.0
    beside = np.linalg.norm(bridge().cloud[:, :2] - of_the_demo.home_m[:2], axis=1)
    in_the_way = bridge().cloud[(beside < VEHICLE.inflation_m), 2]
    assert in_the_way.max() < 0.3  # open sky
    assert of_the_demo.home_m[2] == pytest.approx(0.0, abs=0.01)


def test_the_same_inputs_give_the_same_plan(of_the_demo: FlightPlan) -> None:
    assert planned(bridge(), OF_THE_DEMO).model_dump_json() == of_the_demo.model_dump_json()


@pytest.mark.parametrize("seed", range(3))
def test_among_random_obstacles_every_flight_keeps_its_clearance(seed: int) -> None:
    rng = np.random.default_rng(seed)
    world = wall(8.0, 3.0)
    for x, y in rng.uniform([-9, -9], [9, 9], (7, 2)):
        if abs(y) > 1.0:
            size = rng.uniform(0.2, 0.8)
            world.add_points(box((x, y, 0.0), (x + size, y + size, rng.uniform(2, 9))))
    made = planned(world, vehicle=VEHICLE.model_copy(update={"clearance_m": 0.5}))
    assert made.shooting_points
    assert nearest_m(made, world.cloud) >= 0.4 + 0.5 + VEHICLE.position_error_m


def test_a_wall_seen_from_both_sides_is_flown_round() -> None:
    """Both faces of one wall: the way between them leads round it or over it, never through."""
    world = wall()
    world.add(rectangle("wall-02", (0.0, 0.2, 5.0), (0, 1, 0), 6.0, 4.0))
    made = planned(world)
    assert all(c.covered >= 0.995 for c in made.coverage)
    assert any(w.kind == "intermediate" for w in made.waypoints[1:-1])
    assert nearest_m(made, world.cloud) >= VEHICLE.inflation_m


def test_where_there_is_no_room_it_comes_closer() -> None:
    """A second wall 5 m opposite leaves no place 4 m off that is 1.6 m from it."""
    world = wall()
    world.add(rectangle("wall-02", (0.0, -5.0, 5.0), (0, 1, 0), 6.0, 4.0))
    (coverage,) = planned(world, SETTINGS.model_copy(update={"surfaces": ("wall-01",)})).coverage
    assert VEHICLE.inflation_m < coverage.stand_off_m < 4.0 - 0.5
    assert coverage.gsd_mm_px < 1.0
    assert coverage.covered >= 0.99


def test_a_surface_that_cannot_be_reached_is_left_out_and_said() -> None:
    world = wall()
    world.add_points(box((8.0, -1.0, 3.0), (12.0, 1.0, 7.0)))  # it stands in a closed box
    world.add(rectangle("wall-02", (10.0, 0.0, 5.0), (0, -1, 0), 3.0, 3.0))
    made = planned(world)
    assert [item.item for item in made.left_out] == ["wall-02"]
    hidden = next(c for c in made.coverage if c.surface == "wall-02")
    assert hidden.covered == 0.0
    assert hidden.photos == 0
    assert hidden.not_reached


def test_a_tour_longer_than_a_battery_becomes_flights_that_go_on_where_the_last_stopped() -> None:
    whole = planned(wall())
    made = planned(wall(), vehicle=VEHICLE.model_copy(update={"endurance_s": 120.0}))
    assert len(made.flights) > 1
    assert [w.photo for w in made.shooting_points] == [w.photo for w in whole.shooting_points]
    assert sum(f.photos for f in made.flights) == len(made.shooting_points)
    assert all(f.duration_s <= 120.0 * (1 - VEHICLE.reserve) for f in made.flights)
    assert all(f.battery == pytest.approx(f.duration_s / 120.0, abs=1e-3) for f in made.flights)
    assert [f.first for f in made.flights[1:]] == [f.last + 1 for f in made.flights[:-1]]
    for flight in made.each_flight:
        assert flight.waypoints[0].position_m[:2] == made.home_m[:2]
        assert flight.waypoints[-1].position_m == flight.waypoints[0].position_m
        assert nearest_m(flight, wall().cloud) >= VEHICLE.inflation_m
        assert len(mission_items(flight)) <= MOST_ITEMS
    with pytest.raises(BadInput, match="flights"):
        mission_items(made)


def test_a_mission_longer_than_a_vehicle_takes_is_split(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tasks.planning.flights.MOST_ITEMS", 100)
    made = planned(wall())
    counts = [len(mission_items(flight)) for flight in made.each_flight]
    assert len(counts) > 1
    assert max(counts) <= 100
    assert min(counts[:-1]) > 90  # no battery is changed before it must be
    with pytest.raises(BadInput, match="at most 650"):
        mission_items(made.model_copy(update={"waypoints": made.waypoints * 4, "flights": ()}))


def test_a_battery_that_does_not_reach_is_refused() -> None:
    problem = refusal(wall(), endurance_s=12.0)
    assert problem.item == "vehicle.endurance_s"


def refusal(world: World, **changed: object) -> BadInput:
    settings = SETTINGS.model_copy(
        update={k: v for k, v in changed.items() if k in PlanSettings.model_fields}
    )
    vehicle = VEHICLE.model_copy(update={k: v for k, v in changed.items() if k in Vehicle.model_fields})
    home = changed.get("home_m")
    with pytest.raises(BadInput) as problem:
        planned(world, settings, vehicle, home)  # type: ignore[arg-type]
    return problem.value


def test_a_stand_off_below_the_clearance_names_the_safe_gsd() -> None:
    problem = refusal(wall(), gsd_mm_px=0.1)
    assert problem.item == "plan.gsd_mm_px"
    safe = float(problem.remedy.split(" mm/px")[0].split()[-1])
    assert CAMERA.stand_off_m(safe) >= VEHICLE.inflation_m
    assert planned(wall(2.0, 2.0), SETTINGS.model_copy(update={"gsd_mm_px": safe})).coverage[0].covered > 0.99


def test_an_unknown_surface_names_those_that_exist() -> None:
    problem = refusal(wall(), surfaces=("wall-1",))
    assert "wall-1" in problem.what
    assert "wall-01" in problem.remedy
    assert "ground-01" in problem.remedy


def test_no_surface_is_refused() -> None:
    assert "no surface" in refusal(World().add_points(box((0, 0, 0), (1, 1, 1)))).what
    only_ground = World().add(rectangle("ground-01", (0.0, 0.0, 0.0), (0, 0, 1), 9.0, 9.0))
    assert "ground-01" in refusal(only_ground).remedy


@pytest.mark.parametrize(
    ("home", "why"), [((0.0, 0.0, 5.0), "no free way up"), ((0.0, -10.0, -6.0), "under the ground")]
)
def test_a_home_that_is_no_home_is_refused(home: Vector3, why: str) -> None:
    problem = refusal(wall(), home_m=home)
    assert problem.item == "home_m"
    assert why in problem.what


def test_a_home_is_kept_where_it_is_free() -> None:
    made = planned(wall(), home_m=(5.0, -12.0, 0.0))
    assert made.home_m == (5.0, -12.0, 0.0)
    assert made.waypoints[0].position_m[:2] == (5.0, -12.0)


def test_a_home_without_a_way_out_is_refused() -> None:
    world = wall().add_points(box((5.0, -15.0, 0.0), (13.0, -7.0, 8.0)))  # a hall
    problem = refusal(world, home_m=(9.0, -11.0, 0.0))
    assert "no way leads" in problem.what


def test_a_gimbal_that_cannot_look_there_is_refused() -> None:
    problem = refusal(wall(), gimbal_pitch_min_deg=60.0)
    assert "gimbal" in problem.what
    assert "gimbal" in problem.remedy


def test_a_footprint_smaller_than_the_jitter_is_refused() -> None:
    assert "jitter" in refusal(wall(), position_jitter_m=0.5, clearance_m=0.1).what


def test_the_ground_can_be_inspected_when_named() -> None:
    world = World().add(rectangle("ground-01", (0.0, 0.0, 0.0), (0, 0, 1), 5.0, 4.0))
    made = planned(world, SETTINGS.model_copy(update={"surfaces": ("ground-01",)}))
    assert made.coverage[0].covered >= 0.995
    assert {w.pitch_deg for w in made.shooting_points} == {-90.0}


def test_a_camera_whose_distortion_folds_its_image_is_refused() -> None:
    camera = CAMERA.model_copy(update={"focal_px": 900.0, "k1": -0.25})
    with pytest.raises(BadInput, match="distortion"):
        plan_and_prove(wall().structure, wall().cloud, camera, VEHICLE, ORIGIN, None, SETTINGS)


def test_a_strip_narrower_than_the_squares_of_the_proof_is_judged_too() -> None:
    strip = rectangle("strip-01", (0.0, 0.0, 9.5), (0, -1, 0), 6.0, 0.05)
    made = planned(wall().add(strip))
    judged = {coverage.surface: coverage for coverage in made.coverage}["strip-01"]
    assert judged.covered > 0.9
    assert judged.reachable > 0.9
