"""From a structure to a flight plan: the paper's section 2.3, step by step."""

from collections import Counter
from collections.abc import Callable, Sequence

import numpy as np
import numpy.typing as npt

from schemas.camera import Camera
from schemas.contract import Vector3
from schemas.flight_plan import FlightPlan, SurfaceCoverage, Waypoint
from schemas.geodesy import GeoOrigin
from schemas.problem import BadInput, LeftOut
from schemas.settings import PlanSettings
from schemas.structure import Structure
from schemas.surface import Surface
from schemas.vehicle import Vehicle
from tasks.planning.airspace import Airspace
from tasks.planning.coverage import reasons, seen_by
from tasks.planning.home import find_home, take_off_place
from tasks.planning.occupancy import VoxelGrid, voxel_grid
from tasks.planning.request import check_camera, check_stand_off, chosen_surfaces
from tasks.planning.route import Stop, flying_order, legs
from tasks.planning.sight import Scene
from tasks.planning.timing import duration_s, path_length_m
from tasks.planning.tour import to_and_fro
from tasks.planning.viewpoints import View, Views, shooting_grid, shooting_points, widened_overlap

Array = npt.NDArray[np.float64]

AROUND_M = 15.0  # how far beyond the shooting points a way round or a home is looked for
CLOSER = 0.8  # where there is no room at the asked stand-off, one this much shorter is tried
ENOUGH = 0.9  # squareness at which no shorter stand-off is tried
MOST_CLOSE_UPS = 500  # photos of one surface that coming closer may cost
SHORT = 0.9  # less of a surface covered than this is said


def plan(
    structure: Structure,
    points_m: Array,
    camera: Camera,
    vehicle: Vehicle,
    origin: GeoOrigin,
    home_m: Vector3 | None,
    settings: PlanSettings,
    on_progress: Callable[[float], None] = lambda fraction: None,
) -> FlightPlan:
    """Plan the inspection flight. points_m: (N, 3) float64, the structure's occupied points.

    Raises BadInput where nothing can be flown, with what would make it possible; a surface that cannot be
    photographed while others can is left out and listed.
    """
    surfaces = chosen_surfaces(structure, settings.surfaces)
    gsd = settings.gsd_mm_px or settings.smallest_crack_mm
    stand_off = camera.stand_off_m(gsd)
    check_camera(camera)
    check_stand_off(gsd, camera, vehicle)
    if not len(points_m):
        raise BadInput(
            "structure", "it has no occupied points", "Extract the surfaces of a scanned cloud again."
        )
    airspace = Airspace(points_m, vehicle.inflation_m, settings.min_altitude_m, settings.max_altitude_m)
    scene = Scene(structure.surfaces, points_m)
    overlap = widened_overlap(settings.overlap, camera.footprint_m(stand_off), vehicle.position_jitter_m)
    on_progress(0.1)

    found = {
        s.name: roomiest_views(s, camera, vehicle, stand_off, overlap, settings, airspace, scene)
        for s in surfaces
    }
    views = [view for each in found.values() for view in each.views]
    if not views:
        raise nothing_to_shoot(found, airspace)
    on_progress(0.4)

    places = np.array([v.pose.position_m for v in views])
    grid = grid_around(places, home_m, airspace, settings.voxel_m)
    entrances = [grid.entrance(place, airspace) for place in places]
    if home_m is None:
        components = Counter(int(grid.component[e]) for e in entrances if e is not None)
        home, top = find_home(airspace, grid, components, places)
    else:
        home, top = home_m, take_off_place(home_m, airspace)
    gate = grid.entrance(np.array(top), airspace)
    stops = [Stop(np.array(top), 0.0, gate)] if gate else []
    reached = []
    for view, place, entrance in zip(views, places, entrances, strict=True):
        if gate and entrance and grid.component[entrance] == grid.component[gate]:
            stops.append(Stop(place, view.pose.yaw_deg, entrance, view.surface))
            reached.append(view)
        else:
            found[view.surface].refused["no free way there from home"] += 1
    if not reached:
        raise BadInput(
            "home_m",
            f"no way leads from ({home[0]:g}, {home[1]:g}, {home[2]:g}) to any shooting point"
            f" {airspace.inflation_m:.2f} m away from everything",
            "Give another home_m, or lower vehicle.clearance_m or the position error.",
        )
    on_progress(0.5)

    start = np.concatenate([[0], 1 + to_and_fro(reached)])
    order = flying_order(stops, start, vehicle, airspace)
    paths = legs([stops[i] for i in order], grid, airspace, (settings.a1, settings.a2, settings.a3))
    waypoints = waypoints_along(paths, [reached[i - 1] for i in order[1:]])
    on_progress(0.8)

    coverage = tuple(
        covered(s, found[s.name], waypoints, camera, gsd, settings.max_incidence_deg, scene) for s in surfaces
    )
    duration = duration_s(home, waypoints, vehicle, camera)
    on_progress(1.0)
    return FlightPlan(
        camera=camera,
        vehicle=vehicle,
        origin=origin,
        home_m=home,
        waypoints=waypoints,
        coverage=coverage,
        length_m=round(path_length_m(home, waypoints), 3),
        duration_s=round(duration, 2),
        overlap=round(overlap, 4),
        left_out=left_out(coverage, duration, vehicle),
    )


def roomiest_views(
    surface: Surface,
    camera: Camera,
    vehicle: Vehicle,
    stand_off_m: float,
    overlap: float,
    settings: PlanSettings,
    airspace: Airspace,
    scene: Scene,
) -> Views:
    """Shooting points at the asked stand-off, or closer by where many would be refused or very oblique
    there: a smaller ground sample distance than asked shows no less, and costs more photos."""
    best = shooting_points(surface, camera, vehicle, stand_off_m, overlap, settings, airspace, scene)
    while best.squareness < ENOUGH and (stand_off_m := CLOSER * stand_off_m) >= vehicle.inflation_m:
        if len(shooting_grid(surface, camera.footprint_m(stand_off_m), overlap, 0.0)[0]) > MOST_CLOSE_UPS:
            break
        views = shooting_points(surface, camera, vehicle, stand_off_m, overlap, settings, airspace, scene)
        if views.squareness > best.squareness + 0.01:
            best = views
    return best


def grid_around(places_m: Array, home_m: Vector3 | None, airspace: Airspace, voxel_m: float) -> VoxelGrid:
    """The occupancy grid over the shooting points and home, from the ground up, with room to fly round and
    over what stands there."""
    known = np.vstack([places_m, home_m]) if home_m is not None else places_m
    low, high = known.min(axis=0), known.max(axis=0)
    low[:2] -= AROUND_M
    high[:2] += AROUND_M
    xy = airspace.points_m[:, :2]
    here = airspace.points_m[np.all((xy >= low[:2]) & (xy <= high[:2]), axis=1)]
    low[2] = min([low[2], *airspace.ground.at(known), *airspace.ground.at(here)])
    high[2] = max([high[2], *here[:, 2]]) + airspace.inflation_m + 2.0
    return voxel_grid(airspace, low, high, voxel_m)


def waypoints_along(paths: Sequence[Array], views: Sequence[View]) -> tuple[Waypoint, ...]:
    """Waypoints from above home through every shooting point back to above home, photos named in order."""
    taken: Counter[str] = Counter()
    waypoints: list[Waypoint] = []
    for path, view in zip(paths, [*views, None], strict=True):
        yaw = view.pose.yaw_deg if view else (waypoints[-1].yaw_deg if waypoints else 0.0)
        between = path[:-1] if not waypoints else path[1:-1]
        waypoints += [Waypoint(kind="intermediate", position_m=_rounded(p), yaw_deg=yaw) for p in between]
        if view is None:
            waypoints.append(Waypoint(kind="intermediate", position_m=_rounded(path[-1]), yaw_deg=yaw))
            break
        taken[view.surface] += 1
        waypoints.append(
            Waypoint(
                kind="shooting",
                position_m=view.pose.position_m,
                yaw_deg=yaw,
                pitch_deg=view.pose.pitch_deg,
                surface=view.surface,
                photo=f"{view.surface}-{taken[view.surface]:04d}",
            )
        )
    return tuple(waypoints)


def _rounded(place: Array) -> Vector3:
    return round(float(place[0]), 4), round(float(place[1]), 4), round(float(place[2]), 4)


def covered(
    surface: Surface,
    found: Views,
    waypoints: Sequence[Waypoint],
    camera: Camera,
    gsd_mm_px: float,
    max_incidence_deg: float,
    scene: Scene,
) -> SurfaceCoverage:
    poses = [w.pose for w in waypoints if w.surface == surface.name]
    seen = seen_by(surface, camera, poses, gsd_mm_px, max_incidence_deg, scene)
    return SurfaceCoverage(
        surface=surface.name,
        area_m2=surface.area_m2,
        covered=round(seen.covered, 5),
        stand_off_m=round(found.stand_off_m, 4),
        gsd_mm_px=round(camera.gsd_mm_px(found.stand_off_m), 5),
        photos=len(poses),
        not_reached=reasons(seen, found.refused),
    )


def nothing_to_shoot(found: dict[str, Views], airspace: Airspace) -> BadInput:
    why = sum((each.refused for each in found.values()), Counter())
    told = (
        "; ".join(f"{count} × {reason}" for reason, count in why.most_common(3)) or "no free way leads there"
    )
    return BadInput(
        "plan",
        f"none of the shooting points can be flown: {told}",
        "Allow a wider gimbal range or plan.max_incidence_deg, or make the vehicle's safety distance of"
        f" {airspace.inflation_m:.2f} m smaller (vehicle.radius_m, vehicle.clearance_m, position error).",
    )


def left_out(coverage: Sequence[SurfaceCoverage], duration: float, vehicle: Vehicle) -> tuple[LeftOut, ...]:
    """Surfaces that are not seen whole, and a flight that is longer than a battery lasts."""
    items = [
        LeftOut(
            item=c.surface,
            stage="planning",
            what=f"only {c.covered:.0%} of it will be seen: {'; '.join(c.not_reached)}",
            remedy="Photograph the rest by hand, or change vehicle, gimbal, clearance or GSD.",
        )
        for c in coverage
        if c.covered < SHORT
    ]
    usable = vehicle.endurance_s * (1 - vehicle.reserve)
    if duration > usable:
        items.append(
            LeftOut(
                item="battery",
                stage="planning",
                what=f"the flight takes {duration / 60:.0f} min, a battery lasts {usable / 60:.0f} min"
                " when its reserve is kept",
                remedy="Name fewer surfaces in plan.surfaces and fly several missions.",
            )
        )
    return tuple(items)
