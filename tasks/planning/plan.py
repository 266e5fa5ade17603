"""From a structure to a flight plan: the paper's section 2.3, step by step."""

from collections import Counter
from collections.abc import Callable, Sequence

import numpy as np
import numpy.typing as npt

from schemas.camera import Camera
from schemas.contract import Vector3
from schemas.crack import Crack
from schemas.flight_plan import Flight, FlightPlan, Waypoint
from schemas.geodesy import GeoOrigin
from schemas.problem import BadInput
from schemas.settings import PlanSettings
from schemas.structure import Structure
from schemas.surface import Surface
from schemas.vehicle import Vehicle
from tasks.planning.airspace import Airspace
from tasks.planning.allowed import allowed_region
from tasks.planning.close_ups import close_ups
from tasks.planning.completing import complete
from tasks.planning.coverage import samples_of
from tasks.planning.flights import TooFar, flights, waypoints_along
from tasks.planning.home import home_base
from tasks.planning.occupancy import VoxelGrid, voxel_grid
from tasks.planning.proof import WidthMap, prove, times_of_photos
from tasks.planning.refusals import left_out, no_way, nothing_to_shoot
from tasks.planning.request import check_camera, chosen_surfaces, planned_stand_off_m
from tasks.planning.route import Stop, Ways, flying_order
from tasks.planning.sight import Scene
from tasks.planning.stated_places import in_the_model
from tasks.planning.timing import duration_s, path_length_m
from tasks.planning.tour import to_and_fro
from tasks.planning.viewpoints import View, Views, shooting_grid, shooting_points, widened_overlap
from tasks.planning.way_home import return_height_m

Array = npt.NDArray[np.float64]

AROUND_M = 15.0  # how far beyond the shooting points a way round or a home is looked for
OVER_M = 2.0  # above the highest thing and the inflation, so that there is a way over it
CLOSER = 0.8  # where there is no room at the asked stand-off, one this much shorter is tried
ENOUGH = 0.9  # squareness at which no shorter stand-off is tried
MOST_CLOSE_UPS = 500  # photos of one surface that coming closer may cost


def plan_and_prove(
    structure: Structure,
    points_m: Array,
    camera: Camera,
    vehicle: Vehicle,
    origin: GeoOrigin,
    home_m: Vector3 | None,
    settings: PlanSettings,
    on_progress: Callable[[float], None] = lambda fraction: None,
    cracks: Sequence[Crack] = (),
) -> tuple[FlightPlan, tuple[WidthMap, ...]]:
    """Plan the inspection's flights, and prove what they will see: for each surface, in the plan's order, the
    smallest crack width that can be measured at each place. points_m: (N, 3) float64, the structure's
    occupied points.

    The vehicle keeps radius, clearance and position error from every scanned point, and radius and position
    error from air that nobody has seen to be free (`allowed`), from the fence and from no-fly boxes.

    cracks: of an earlier pass; the flights then show strips along these, in place of whole surfaces.

    Raises BadInput where nothing can be flown, with what would make it possible; a surface that cannot be
    photographed while others can is left out and listed.
    """
    settings, home_m = in_the_model(structure, settings, home_m)
    if cracks:
        surfaces = close_ups(structure.surfaces, cracks)
    else:
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
    heights = settings.min_altitude_m, settings.max_altitude_m
    airspace = Airspace(points_m, vehicle.inflation_m, *heights, allowed, settings.water_m)
    scene = Scene(structure.surfaces, points_m)
    on_progress(0.1)

    found = {
        s.name: roomiest_views(s, camera, vehicle, stand_off, overlap, settings, airspace, scene)
        for s in surfaces
    }
    views = [view for each in found.values() for view in each.views]
    if not views:
        raise nothing_to_shoot(found, airspace)
    on_progress(0.3)

    places = np.array([v.pose.position_m for v in views])
    grid = grid_around(places, home_m, airspace, settings.voxel_m)
    base = home_base(home_m, airspace, grid, places)
    samples = {s.name: samples_of(s, camera, gsd) for s in surfaces}
    completed = {
        s.name: complete(
            s, camera, vehicle, found[s.name].stand_off_m, gsd, settings, airspace, scene,
            tuple(view for view in found[s.name].views if base.leads_to(view.pose.position_m)),
            base.ways_to, samples[s.name],
        )
        for s in surfaces
    }  # fmt: skip
    views = [view for each in completed.values() for view in each.views]
    stops = [Stop(np.array(base.top_m), 0.0, base.gate)]
    shot: list[View] = []
    for view in views:
        place = np.array(view.pose.position_m)
        if entrance := base.leads_to(view.pose.position_m):
            stops.append(Stop(place, view.pose.yaw_deg, entrance, view.surface, view.pose.pitch_deg))
            shot.append(view)
    if not shot:
        raise no_way(base.home_m, airspace)
    on_progress(0.5)

    start = np.concatenate([[0], 1 + to_and_fro(shot)])
    order = flying_order(stops, start, vehicle, airspace)
    stops, shot = [stops[i] for i in order], [shot[i - 1] for i in order[1:]]
    ways = Ways(grid, airspace, (settings.a1, settings.a2, settings.a3))
    waypoints: list[Waypoint] = []
    flown: list[Flight] = []
    taken: Counter[str] = Counter()
    for numbers, paths in flights_within_reach(stops, shot, ways, base.home_m, vehicle, camera):
        own = waypoints_along(paths, [shot[n - 1] for n in numbers], taken)
        flown.append(flight_of(len(waypoints), own, base.home_m, vehicle, camera))
        waypoints += own
    on_progress(0.7)

    times_s = times_of_photos(waypoints, flown, base.home_m, vehicle, camera)
    proofs = tuple(
        prove(
            s, camera, vehicle, waypoints, times_s, found[s.name].stand_off_m, gsd,
            settings.max_incidence_deg, scene, completed[s.name], samples[s.name],
        )
        for s in surfaces
    )  # fmt: skip
    coverage = tuple(proof.coverage for proof in proofs)
    on_progress(1.0)
    made = FlightPlan(
        camera=camera,
        vehicle=vehicle,
        origin=origin,
        home_m=base.home_m,
        waypoints=tuple(waypoints),
        coverage=coverage,
        length_m=round(sum(flight.length_m for flight in flown), 3),
        duration_s=round(sum(flight.duration_s for flight in flown), 2),
        overlap=round(overlap, 4),
        fence_m=settings.fence_m,
        no_fly_m=settings.no_fly_m,
        flights=tuple(flown),
        return_height_m=return_height_m(waypoints, flown, base.home_m, base.top_m, airspace),
        left_out=left_out(coverage),
    )
    return made, tuple(proof.widths for proof in proofs)


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
    ways: Ways,
    home_m: Vector3,
    vehicle: Vehicle,
    camera: Camera,
) -> list[tuple[range, list[Array]]]:
    """The tour cut into flights; what no battery reaches is taken out of `stops` and `shot`."""
    while True:
        try:
            return flights(stops, ways, home_m, vehicle, camera)
        except TooFar as problem:
            if len(shot) == 1:
                usable = vehicle.endurance_s * (1 - vehicle.reserve)
                raise BadInput(
                    "vehicle.endurance_s",
                    f"a battery lasts {usable:.0f} s when its reserve of {vehicle.reserve:.0%} is kept, and"
                    f" the nearest shooting point and back takes {problem.seconds:.0f} s",
                    "Give a home_m nearer to the surfaces, a lower reserve or a vehicle that flies longer.",
                ) from None
            del stops[problem.number]
            del shot[problem.number - 1]


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
