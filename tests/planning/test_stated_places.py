"""What a crew states in the coordinates of its scans holds also where the model was shifted."""

import pytest

from schemas.box import Box
from schemas.contract import Vector2, Vector3
from schemas.problem import BadInput
from schemas.settings import PlanSettings
from schemas.structure import Structure
from tasks.planning.plan import plan_and_prove
from tasks.planning.stated_places import in_the_model
from tests.planning.structures import CAMERA, OPEN, ORIGIN, VEHICLE, wall

SHIFT: Vector3 = (691_600.0, 5_334_800.0, 0.0)
LOW, HIGH, HOME = (-5.0, -9.0, 0.0), (4.0, -2.0, 8.0), (0.0, -6.0, 0.0)
FENCE: tuple[Vector2, ...] = ((-9.0, -9.0), (9.0, -9.0), (0.0, 9.0))


def shifted() -> Structure:
    return wall().structure.model_copy(update={"world_origin_m": SHIFT})


def moved(place: Vector3, by: Vector3 = SHIFT) -> Vector3:
    return place[0] + by[0], place[1] + by[1], place[2] + by[2]


def test_the_scans_coordinates_and_the_models_mean_the_same() -> None:
    local = PlanSettings(
        free_m=(Box(low_m=LOW, high_m=HIGH),), no_fly_m=(Box(low_m=LOW, high_m=HIGH),), fence_m=FENCE
    )
    far = Box(low_m=moved(LOW), high_m=moved(HIGH))
    fence = tuple((e + SHIFT[0], n + SHIFT[1]) for e, n in FENCE)
    of_scans = PlanSettings(free_m=(far,), no_fly_m=(far,), fence_m=fence)
    for settings, home in ((local, HOME), (of_scans, moved(HOME))):
        assert in_the_model(shifted(), settings, home) == (local, HOME)


def test_a_plan_is_the_same_in_either_coordinates() -> None:
    """And so is its fence, as the missions carry it."""
    world, made = wall(), []
    for structure, by in ((world.structure, (0.0, 0.0, 0.0)), (shifted(), SHIFT)):
        air = Box(low_m=moved(OPEN.low_m, by), high_m=moved(OPEN.high_m, by))
        fence = tuple((e + by[0], n + by[1]) for e, n in ((-60, -60), (60, -60), (60, 60), (-60, 60)))
        settings = PlanSettings(gsd_mm_px=1.0, overlap=0.5, free_m=(air,), fence_m=fence)
        home = moved(HOME, by)
        made.append(plan_and_prove(structure, world.cloud, CAMERA, VEHICLE, ORIGIN, home, settings)[0])
    assert made[0] == made[1]


@pytest.mark.parametrize("key", ["no_fly_m", "free_m"])
def test_a_box_that_lies_nowhere_near_is_refused(key: str) -> None:
    """It would keep the vehicle out of nothing."""
    lost = Box(low_m=moved(LOW, (691_600.0, 0.0, 0.0)), high_m=moved(HIGH, (691_600.0, 0.0, 0.0)))
    with pytest.raises(BadInput, match=rf"plan\.{key}: .* km from the model"):
        in_the_model(shifted(), PlanSettings(**{key: (lost,)}), None)


def test_a_model_that_was_not_shifted_takes_all_as_it_stands() -> None:
    settings = PlanSettings(no_fly_m=(Box(low_m=moved(LOW), high_m=moved(HIGH)),))
    assert in_the_model(wall().structure, settings, None) == (settings, None)
