"""The stage: a structure's surfaces become a flight plan."""

from collections.abc import Mapping
from typing import Any

from artifacts import store
from artifacts.page import Page
from artifacts.picture import markdown_of
from schemas.camera import Camera
from schemas.contract import Vector3
from schemas.flight_plan import FlightPlan
from schemas.geodesy import GeoOrigin
from schemas.settings import PlanSettings
from schemas.structure import Structure
from schemas.vehicle import Vehicle
from tasks.stage import progress, stage


def pages(inputs: Mapping[str, Any], made: FlightPlan) -> list[Page]:
    from tasks.planning.picture import draw_plan

    structure: Structure = inputs["structure"]
    lines = [
        "### Flight plan",
        f"{len(made.shooting_points)} photos, {made.length_m:.0f} m, {made.duration_s / 60:.1f} min,"
        f" overlap {made.overlap:.0%}.",
        "| surface | area m² | covered | stand-off m | mm/px | photos | not reached |",
        "|---|---|---|---|---|---|---|",
        *(
            f"| {c.surface} | {c.area_m2:.2f} | {c.covered:.1%} | {c.stand_off_m:.2f} | {c.gsd_mm_px:.2f}"
            f" | {c.photos} | {'; '.join(c.not_reached)} |"
            for c in made.coverage
        ),
        "",
        markdown_of(draw_plan(made, structure.surfaces), "flight plan"),
    ]
    rows = [
        {
            "waypoint": number,
            "kind": w.kind,
            "east_m": round(w.position_m[0], 2),
            "north_m": round(w.position_m[1], 2),
            "up_m": round(w.position_m[2], 2),
            "yaw_deg": round(w.yaw_deg, 1),
            "pitch_deg": round(w.pitch_deg, 1),
            "photo": w.photo or "",
        }
        for number, w in enumerate(made.waypoints, start=1)
    ]
    return [Page(key="plan", markdown="\n".join(lines)), Page(key="waypoints", table=rows)]


@stage(pages=pages)
def plan_flight(
    structure: Structure,
    camera: Camera,
    vehicle: Vehicle,
    origin: GeoOrigin,
    home_m: Vector3 | None,
    settings: PlanSettings,
) -> FlightPlan:
    """Shooting points over the surfaces to inspect, a tour of them, a collision-free path, and its proof."""
    from tasks.planning.occupied_points import read_points
    from tasks.planning.plan import plan

    points = read_points(store.current().path(structure.occupied))
    return plan(structure, points, camera, vehicle, origin, home_m, settings, progress)
