"""What `hairline plan` warns of."""

from flows.plan_command import looks_up
from schemas.vehicle import Vehicle
from tests.flight.wall_plan import wall_plan


def test_photos_that_look_steeply_up_are_doubted_unless_the_gimbals_range_is_stated() -> None:
    plan = wall_plan()
    doubt = looks_up(plan, Vehicle())
    assert doubt is not None and "1 photos look up by as much as 90°" in doubt
    assert looks_up(plan, Vehicle(gimbal_pitch_max_deg=90.0)) is None
    level = tuple(w for w in plan.waypoints if w.surface != "soffit")
    assert looks_up(plan.model_copy(update={"waypoints": level}), Vehicle()) is None
