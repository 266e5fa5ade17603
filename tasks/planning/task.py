"""The stage: a structure's surfaces become a flight plan."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from artifacts import store
from artifacts.page import Page
from artifacts.picture import markdown_of
from schemas.camera import Camera
from schemas.contract import Vector3
from schemas.crack import Crack
from schemas.flight_plan import FlightPlan
from schemas.geodesy import GeoOrigin
from schemas.settings import PlanSettings
from schemas.structure import Structure
from schemas.vehicle import Vehicle
from tasks.stage import progress, stage

if TYPE_CHECKING:
    from tasks.planning.what_if import Case, Effort

Widths = npt.NDArray[np.float32]


def pages(inputs: Mapping[str, Any], made: FlightPlan) -> list[Page]:
    from tasks.planning.picture import draw_plan, draw_widths

    structure: Structure = inputs["structure"]
    lines = [
        "### Flight plan",
        f"{len(made.shooting_points)} photos, {made.length_m:.0f} m, {made.duration_s / 60:.1f} min,"
        f" overlap {made.overlap:.0%}, {len(made.each_flight)} of a battery each.",
        "",
        f"{made.way_home}.",
        "",
        *([_anchored(made.origin), ""] if made.origin.residual_m is not None else []),
        "| surface | area m² | covered | can be reached | of it in two photos | in 95 of 100 flights"
        " | measurable mm | stand-off m | mm/px | photos | not reached |",
        "|---|---|---|---|---|---|---|---|---|---|---|",
        *(
            f"| {c.surface} | {c.area_m2:.2f} | {c.covered:.1%} | {c.reachable:.1%} | {c.twice or 0:.1%}"
            f" | {c.twice_p05 or 0:.1%} | {c.measurable_mm or 0:.2f} | {c.stand_off_m:.2f}"
            f" | {c.gsd_mm_px:.2f} | {c.photos} | {'; '.join(c.not_reached)} |"
            for c in made.coverage
        ),
        "",
        "| flight | photos | m | min | of a battery |",
        "|---|---|---|---|---|",
        *(
            f"| {n} | {f.photos} | {f.length_m:.0f} | {f.duration_s / 60:.1f} | {f.battery:.0%} |"
            for n, f in enumerate(made.flights, start=1)
        ),
        "",
        markdown_of(draw_plan(made, structure.surfaces), "flight plan"),
        "",
        "Smallest crack width that can be measured, surface by surface:",
        "",
        markdown_of(draw_widths(width_maps(made)), "measurable widths"),
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


def _anchored(origin: GeoOrigin) -> str:
    return (
        f"Anchored by known points: {origin.latitude_deg:.7f}°, {origin.longitude_deg:.7f}°, the model turned"
        f" {origin.heading_deg:.2f}° from north; {origin.residual_m:.2f} m are left at the worst of them."
    )


@stage(pages=pages)
def plan_flight(
    structure: Structure,
    camera: Camera,
    vehicle: Vehicle,
    origin: GeoOrigin,
    home_m: Vector3 | None,
    settings: PlanSettings,
    cracks: tuple[Crack, ...] = (),
) -> FlightPlan:
    """Shooting points over the surfaces to inspect, a tour of them, a collision-free path, and its proof.

    cracks: of an earlier pass, to be looked at closely in place of whole surfaces."""
    import tifffile

    from tasks.planning.occupied_points import read_points
    from tasks.planning.plan import plan_and_prove

    shelf = store.current()
    points = read_points(shelf.path(structure.occupied))
    made, maps = plan_and_prove(
        structure, points, camera, vehicle, origin, home_m, settings, progress, cracks
    )
    coverage = []
    with shelf.scratch() as folder:
        for number, (of_surface, widths) in enumerate(zip(made.coverage, maps, strict=True)):
            path = folder / f"width_{number}_mm.tif"  # a name of its own: what was put is linked, not copied
            tifffile.imwrite(path, widths.width_mm, compression="zlib", metadata=None)
            coverage.append(of_surface.model_copy(update={"width_map": shelf.put(path)}))
    return made.model_copy(update={"coverage": tuple(coverage)})


def what_if(
    camera: Camera, vehicle: Vehicle, overlap: float, area_m2: float, stand_off_m: float | None
) -> "list[tuple[Case, Effort]]":
    """What this camera sees and what an area takes, at the usual crack widths or from one stand-off; no
    stage: only the command line asks for it."""
    from tasks.planning.what_if import case_at, cases

    seen = (
        [case_at(stand_off_m, camera, vehicle, overlap)] if stand_off_m else cases(camera, vehicle, overlap)
    )
    return [(one, one.effort(area_m2, vehicle, camera)) for one in seen]


def effort(
    structure: Structure,
    camera: Camera,
    vehicle: Vehicle,
    settings: PlanSettings,
    cracks: tuple[Crack, ...] = (),
) -> "Effort":
    """About what a plan will take, before it is made."""
    from tasks.planning.close_ups import close_ups
    from tasks.planning.request import chosen_surfaces
    from tasks.planning.what_if import effort_of

    surfaces = (
        close_ups(structure.surfaces, cracks) if cracks else chosen_surfaces(structure, settings.surfaces)
    )
    return effort_of(surfaces, camera, vehicle, settings)


def width_maps(made: FlightPlan) -> dict[str, Widths]:
    """Of each surface by name the smallest measurable width, (H, W) float32 mm, its top first."""
    import tifffile

    shelf = store.current()
    return {
        c.surface: tifffile.imread(shelf.path(c.width_map)) for c in made.coverage if c.width_map is not None
    }
