"""What cannot be flown: one clear message each, that says what would make it possible."""

import re

import pytest

from schemas.contract import Vector3
from schemas.problem import BadInput
from schemas.settings import PlanSettings
from schemas.vehicle import Vehicle
from tasks.planning.plan import plan_and_prove
from tests.planning.structures import CAMERA, OPEN, ORIGIN, VEHICLE, World, box, rectangle, wall

FENCE = ((20.0, 20.0), (30.0, 20.0), (30.0, 30.0), (20.0, 30.0))  # beside the wall, not round it
ONLY_POINTS = World().add_points(box((0, 0, 0), (1, 1, 1)))
ONLY_GROUND = World().add(rectangle("ground-01", (0.0, 0.0, 0.0), (0, 0, 1), 9.0, 9.0))


def refusal(
    world: World, plan: dict[str, object], vehicle: dict[str, object], home_m: Vector3 | None = None
) -> BadInput:
    settings = PlanSettings.model_validate({"gsd_mm_px": 1.0, "overlap": 0.5, "free_m": (OPEN,)} | plan)
    flown = Vehicle.model_validate(VEHICLE.model_dump() | vehicle)
    with pytest.raises(BadInput) as problem:
        plan_and_prove(world.structure, world.cloud, CAMERA, flown, ORIGIN, home_m, settings)
    return problem.value


@pytest.mark.parametrize(
    ("world", "plan", "vehicle", "home_m", "item", "helps"),
    [
        (wall(), {"gsd_mm_px": None, "smallest_crack_mm": 0.01}, {}, None, "plan.gsd_mm_px", "lens|RTK"),
        (wall(), {"gsd_mm_px": 0.4}, {}, None, "plan.gsd_mm_px", r"Ask for 0\.\d+ mm/px or coarser"),
        (
            *(wall(), {}, {"position_jitter_m": 0.42, "position_bias_m": 0.0, "clearance_m": 0.0}, None),
            *("vehicle.position_jitter_m", "coarser|RTK"),
        ),
        (wall(), {}, {}, (0.0, 0.0, 5.0), "home_m", "open ground"),
        (wall(), {"fence_m": FENCE}, {}, None, "plan.fence_m", "[Ww]iden plan.fence_m"),
        (ONLY_POINTS, {}, {}, None, "surfaces", "min_area_m2"),
        (ONLY_GROUND, {}, {}, None, "plan.surfaces", "ground-01"),
    ],
    ids=["crack", "stand-off", "jitter", "home", "fence", "no surface", "ground alone"],
)
def test_it_says_what_would_make_it_possible(
    world: World,
    plan: dict[str, object],
    vehicle: dict[str, object],
    home_m: Vector3 | None,
    item: str,
    helps: str,
) -> None:
    problem = refusal(world, plan, vehicle, home_m)
    assert problem.item == item
    assert re.search(helps, problem.remedy), str(problem)
    assert str(problem).count("\n") == 0


def test_the_fence_that_is_asked_for_holds_the_flight() -> None:
    problem = refusal(wall(), {"fence_m": FENCE}, {})
    found = re.search(r"east (-?\d+) to (-?\d+) m, north (-?\d+) to (-?\d+)", problem.remedy)
    assert found
    west, east, south, north = (float(x) for x in found.groups())
    fence = ((west - 4, south - 4), (east + 4, south - 4), (east + 4, north + 4), (west - 4, north + 4))
    settings = PlanSettings(gsd_mm_px=1.0, overlap=0.5, free_m=(OPEN,), fence_m=fence)
    made, _ = plan_and_prove(wall().structure, wall().cloud, CAMERA, VEHICLE, ORIGIN, None, settings)
    assert made.coverage[0].covered > 0.99
