"""What the crew stated about places, in the model's coordinates: large ones of scans were shifted."""

from schemas.box import Box
from schemas.contract import Vector3
from schemas.settings import PlanSettings
from schemas.structure import Structure


def in_the_model(
    structure: Structure, settings: PlanSettings, home_m: Vector3 | None
) -> tuple[PlanSettings, Vector3 | None]:
    """Boxes, fence and home as the model has them. BadInput for what lies far away, whichever way it was
    meant: a box that keeps the vehicle out of nothing is worse than none."""
    if not any(structure.world_origin_m):
        return settings, home_m

    def boxes(stated: str, given: tuple[Box, ...]) -> tuple[Box, ...]:
        corners = (structure.here(stated, (box.low_m, box.high_m)) for box in given)
        return tuple(Box(low_m=low, high_m=high) for low, high in corners)

    fence_m = settings.fence_m
    if fence_m is not None:
        level_m = structure.min_m[2]
        corners = structure.here("plan.fence_m", [(east, north, level_m) for east, north in fence_m])
        fence_m = tuple((east, north) for east, north, _ in corners)
    known = {
        "free_m": boxes("plan.free_m", settings.free_m),
        "no_fly_m": boxes("plan.no_fly_m", settings.no_fly_m),
        "fence_m": fence_m,
    }
    home = None if home_m is None else structure.here("home_m", (home_m,))[0]
    return settings.model_copy(update=known), home
