"""From a structure to a flight plan: the paper's section 2.3, step by step."""

from collections import Counter
from collections.abc import Callable, Sequence

import numpy as np
import numpy.typing as npt

from schemas.camera import Camera
from schemas.contract import Vector3
from schemas.flight_plan import Flight, FlightPlan, SurfaceCoverage, Waypoint
from schemas.geodesy import GeoOrigin
from schemas.problem import BadInput, LeftOut
from schemas.settings import PlanSettings
from schemas.structure import Structure
from schemas.surface import Surface
from schemas.vehicle import Vehicle
from tasks.planning.airspace import Airspace
from tasks.planning.allowed import allowed_region
from tasks.planning.coverage import reasons, seen_by
from tasks.planning.flights import TooFar, flights, waypoints_along
from tasks.planning.home import find_home, take_off_place
from tasks.planning.occupancy import VoxelGrid, voxel_grid
from tasks.planning.request import check_camera, chosen_surfaces, planned_stand_off_m
from tasks.planning.route import Stop, Ways, flying_order
from tasks.planning.sight import Scene
from tasks.planning.timing import duration_s, path_length_m
from tasks.planning.tour import to_and_fro
from tasks.planning.viewpoints import (
    NO_FLY,
    OUTSIDE,
    UNSEEN,
    View,
    Views,
    shooting_grid,
    shooting_points,
    widened_overlap,
)

Array = npt.NDArray[np.float64]

AROUND_M = 15.0  # how far beyond the shooting points a way round or a home is looked for
OVER_M = 2.0  # above the highest thing and the inflation, so that there is a way over it
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
    """Plan the inspection's flights. points_m: (N, 3) float64, the structure's occupied points.

    The vehicle keeps radius, clearance and position error from every scanned point, and radius and position
    error from air that nobody has seen to be free (`allowed`), from the fence and from no-fly boxes.

    Raises BadInput where nothing can be flown, with what would make it possible; a surface that cannot be
    photographed while others can is left out and listed.
    """
    surfaces = chosen_surfaces(structure, settings.surfaces)
    gsd = settings.asked_gsd_mm_px
    check_camera(camera)
    stand_off = planned_stand_off_m(gsd, camera, vehicle)
    if not len(points_m):
        raise BadInput(
            "structure", "it has no occupied points", "Extract the surfaces of a scanned cloud again."
        )
    overlap = widened_overlap(settings.overlap, camera.footprint_m(stand_off), vehicle.position_jitter_m)
    low, high = region(surfaces, home_m, points_m, stand_off, vehicle, settings)
    allowed = allowed_region(structure, points_m, settings, vehicle.margin_m, low, high)
    airspace = Airspace(
        points_m,
        vehicle.inflation_m,
        settings.min_altitude_m,
        settings.max_altitude_m,
        allowed,
        settings.water_m,
    )
    scene = Scene(structure.surfaces, points_m)
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
            "Give another home_m, state more free air in plan.free_m, or lower vehicle.clearance_m or the"
            " position error.",
        )
    on_progress(0.5)

    start = np.concatenate([[0], 1 + to_and_fro(reached)])
    order = flying_order(stops, start, vehicle, airspace)
    ordered, shot = [stops[i] for i in order], [reached[i - 1] for i in order[1:]]
    ways = Ways(grid, airspace, (settings.a1, settings.a2, settings.a3))
    cut = flights_within_reach(ordered, shot, found, ways, home, vehicle, camera)
    waypoints, flown = [], []
    taken: Counter[str] = Counter()
    for numbers, paths in cut:
        own = waypoints_along(paths, [shot[n - 1] for n in numbers], taken)
        flown.append(flight_of(len(waypoints), own, home, vehicle, camera))
        waypoints += own
    on_progress(0.8)

    coverage = tuple(
        covered(s, found[s.name], waypoints, camera, gsd, settings.max_incidence_deg, scene) for s in surfaces
    )
    on_progress(1.0)
    return FlightPlan(
        camera=camera,
        vehicle=vehicle,
        origin=origin,
        home_m=home,
        waypoints=tuple(waypoints),
        coverage=coverage,
        length_m=round(sum(flight.length_m for flight in flown), 3),
        duration_s=round(sum(flight.duration_s for flight in flown), 2),
        overlap=round(overlap, 4),
        fence_m=settings.fence_m,
        no_fly_m=settings.no_fly_m,
        flights=tuple(flown),
        left_out=left_out(coverage),
    )


def region(
    surfaces: Sequence[Surface],
    home_m: Vector3 | None,
    points_m: Array,
    stand_off_m: float,
    vehicle: Vehicle,
    settings: PlanSettings,
) -> tuple[Array, Array]:
    """(3,) low and (3,) high: all that a flight along the surfaces may need, over and round what stands
    there."""
    corners = np.concatenate([s.to_world(s.outline_m) for s in surfaces])
    known = corners if home_m is None else np.vstack([corners, home_m])
    beyond = stand_off_m + AROUND_M + vehicle.margin_m + 2 * settings.voxel_m
    low, high = known.min(axis=0) - beyond, known.max(axis=0) + beyond
    here = points_m[np.all((points_m[:, :2] >= low[:2]) & (points_m[:, :2] <= high[:2]), axis=1), 2]
    low[2] = min([*here, *known[:, 2]]) - vehicle.margin_m - 2 * settings.voxel_m
    over = max([*here, corners[:, 2].max() + stand_off_m]) + vehicle.inflation_m + OVER_M
    high[2] = over + vehicle.margin_m + 2 * settings.voxel_m
    return low, high


def flights_within_reach(
    stops: list[Stop],
    shot: list[View],
    found: dict[str, Views],
    ways: Ways,
    home_m: Vector3,
    vehicle: Vehicle,
    camera: Camera,
) -> list[tuple[range, list[Array]]]:
    """The tour cut into flights; what no battery reaches is taken out of `stops` and `shot`, and counted."""
    while True:
        try:
            return flights(stops, ways, home_m, vehicle, camera)
        except TooFar as problem:
            if len(shot) == 1:
                usable = vehicle.endurance_s * (1 - vehicle.reserve)
                raise BadInput(
                    "vehicle.endurance_s",
                    f"a battery lasts {usable:.0f} s when its reserve of {vehicle.reserve:.0%} is kept, and the"
                    f" nearest shooting point and back takes {problem.seconds:.0f} s",
                    "Give a home_m nearer to the surfaces, a lower reserve or a vehicle that flies longer.",
                ) from None
            del stops[problem.number]
            view = shot.pop(problem.number - 1)
            found[view.surface].refused["a battery does not last there and back"] += 1


def flight_of(
    first: int, waypoints: Sequence[Waypoint], home_m: Vector3, vehicle: Vehicle, camera: Camera
) -> Flight:
    seconds = duration_s(home_m, waypoints, vehicle, camera)
    return Flight(
        first=first,
        last=first + len(waypoints) - 1,
        photos=sum(w.kind == "shooting" for w in waypoints),
        length_m=round(path_length_m(home_m, waypoints), 3),
        duration_s=round(seconds, 2),
        battery=round(seconds / vehicle.endurance_s, 4),
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
    high[2] = max([high[2], *here[:, 2]]) + airspace.inflation_m + OVER_M
    return voxel_grid(airspace, low, high, voxel_m)


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


REMEDIES = {
    "gimbal": "allow a wider gimbal range or a larger plan.max_incidence_deg",
    "closer": "lower vehicle.radius_m, vehicle.clearance_m or the position error (RTK), or ask for a coarser"
    " plan.gsd_mm_px",
    UNSEEN: "scan from more places, or state air that is free in plan.free_m (hairline plan --free)",
    OUTSIDE: "widen plan.fence_m so that it holds the shooting points with the margin",
    NO_FLY: "make plan.no_fly_m smaller",
    "lower": "lower plan.min_altitude_m",
    "higher": "raise plan.max_altitude_m",
    "hidden": "allow a larger plan.max_incidence_deg, or photograph it by hand",
}


def nothing_to_shoot(found: dict[str, Views], airspace: Airspace) -> BadInput:
    why = sum((each.refused for each in found.values()), Counter())
    told = (
        "; ".join(f"{count} × {reason}" for reason, count in why.most_common(3)) or "no free way leads there"
    )
    helps = [text for reason, _ in why.most_common(3) for key, text in REMEDIES.items() if key in reason]
    places = np.array([place for each in found.values() for place in each.wanted_m])
    box = ""
    if any(OUTSIDE in reason for reason in why) and airspace.allowed is not None:
        grown = airspace.allowed.margin_m + 2 * airspace.allowed.voxel_m
        low, high = places.min(axis=0) - grown, places.max(axis=0) + grown
        box = f" They lie within east {low[0]:.0f} to {high[0]:.0f} m, north {low[1]:.0f} to {high[1]:.0f} m."
    remedy = "; or ".join(helps) or "Give another home_m."
    return BadInput(
        "plan.fence_m" if box else "plan",
        f"none of the shooting points can be flown: {told}",
        remedy[0].upper() + remedy[1:] + "." + box,
    )


def left_out(coverage: Sequence[SurfaceCoverage]) -> tuple[LeftOut, ...]:
    """Surfaces that are not seen whole."""
    return tuple(
        LeftOut(
            item=c.surface,
            stage="planning",
            what=f"only {c.covered:.0%} of it will be seen: {'; '.join(c.not_reached)}",
            remedy="Photograph the rest by hand, or change vehicle, gimbal, clearance or GSD.",
        )
        for c in coverage
        if c.covered < SHORT
    )
