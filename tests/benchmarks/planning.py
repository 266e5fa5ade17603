"""`make bench-planning`: path search, tour, coverage, clearance and a whole bridge, beside other tools.

`python -m tests.benchmarks.planning paths tour` runs these parts alone. Peers come with the `bench` extra;
one that is not installed is a row that says so. Times are CPU seconds of one thread.
"""

import json
import resource
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from tests.benchmarks.table import Row, row

Array = npt.NDArray[np.float64]
Flags = npt.NDArray[np.bool_]
GRID = (200, 200, 60)
QUERIES, SOURCES = 200, 10


def cpu_s(call: Callable[[], Any]) -> tuple[float, Any]:
    began = time.process_time()
    result = call()
    return time.process_time() - began, result


def absent(what: str, peer: str, problem: BaseException) -> Row:
    return row(what, float("nan"), "s", None, f"not installed: {problem}", None, peer) | {"value": None}


# -- path search ----------------------------------------------------------------------------------------


def obstacles(rng: np.random.Generator) -> Flags:
    """Free voxels of a grid with 60 boxes in it, about a quarter of it taken."""
    free = np.ones(GRID, dtype=bool)
    for _ in range(60):
        size = rng.integers(10, 50, 3)
        low = rng.integers(0, np.array(GRID) - 5)
        free[tuple(slice(a, a + s) for a, s in zip(low, size, strict=True))] = False
    return free


def step_graph(free: Flags, weights: tuple[float, float, float]) -> Any:
    """The same steps and costs as a sparse matrix, written apart from the search: no corner is cut."""
    from itertools import product

    from scipy.sparse import coo_array, csr_array

    numbers = np.arange(free.size, dtype=np.int32).reshape(free.shape)
    parts = []
    for step in (s for s in product((-1, 0, 1), repeat=3) if any(s)):
        here = tuple(slice(max(0, -s), n - max(0, s)) for s, n in zip(step, free.shape, strict=True))
        open_ = free[here].copy()
        for corner in product(*[sorted({0, s}) for s in step]):
            moved = tuple(slice(h.start + c, h.stop + c) for h, c in zip(here, corner, strict=True))
            open_ &= free[moved]
        there = tuple(slice(h.start + s, h.stop + s) for h, s in zip(here, step, strict=True))
        rows, columns = numbers[here][open_], numbers[there][open_]
        cost = float(sum(w * s * s for w, s in zip(weights, step, strict=True)))
        parts.append(
            csr_array(coo_array((np.full(len(rows), cost), (rows, columns)), shape=(free.size,) * 2))
        )
    total = parts[0]
    for part in parts[1:]:
        total = total + part
    return total


def paths() -> list[Row]:
    """200 queries from 10 places to 20 each: the cost of each against Dijkstra's on the identical graph."""
    from scipy.sparse.csgraph import dijkstra

    from tasks.planning.astar import PathFinder

    rng = np.random.default_rng(7)
    weights = (1.0, 1.0, 1.0)
    free = obstacles(rng)
    cells = np.argwhere(free)
    starts = rng.choice(cells, SOURCES, replace=False)
    goals = [rng.choice(cells, QUERIES // SOURCES, replace=False) for _ in starts]
    graph = step_graph(free, weights)
    finder = PathFinder(free, weights)
    finder.path(tuple(starts[0]), tuple(goals[0][0]))
    worst, ours, theirs = 0.0, 0.0, 0.0
    for start, ends in zip(starts, goals, strict=True):
        seconds, costs = cpu_s(
            lambda start=start: dijkstra(graph, indices=int(np.ravel_multi_index(tuple(start), GRID)))
        )
        theirs += seconds / SOURCES
        for end in ends:
            seconds, found = cpu_s(lambda a=start, b=end: finder.path(tuple(a), tuple(b)))
            ours += seconds / QUERIES
            truth = costs[np.ravel_multi_index(tuple(end), GRID)]
            cost = np.inf if found is None else found[1]
            worst = max(worst, 0.0 if cost == truth else abs(cost - truth))
    data, seed = "200 × 200 × 60 voxels, 60 boxes, 200 queries", "7"
    rows = [
        row("largest difference of a path's cost", worst, "1", "≤ 1e-9", data, seed, "scipy dijkstra", 0.0),
        row("speed against the peer", theirs / ours, "×", "≥ 20", data, seed, "scipy dijkstra", 1.0),
        row("time of a query", ours * 1000, "ms", None, data, seed, "scipy dijkstra", theirs * 1000),
    ]
    rows += [peer(free, starts, goals, ours, data, seed) for peer in (mcp, pathfinding)]
    return rows


def mcp(free: Flags, starts: Any, goals: Any, ours: float, data: str, seed: str) -> Row:
    name = "skimage MCP_Geometric"
    try:
        from skimage.graph import MCP_Geometric
    except ImportError as problem:
        return absent("time of a query", name, problem)
    costs = np.where(free, 1.0, -1.0)
    seconds, _ = cpu_s(lambda: MCP_Geometric(costs).find_costs([tuple(starts[0])], [tuple(goals[0][0])]))
    return row("speed against the peer", seconds / ours, "×", "≥ 1", data, seed, name, 1.0)


def pathfinding(free: Flags, starts: Any, goals: Any, ours: float, data: str, seed: str) -> Row:
    name = "pathfinding3d"
    try:
        from pathfinding3d.core.diagonal_movement import DiagonalMovement
        from pathfinding3d.core.grid import Grid
        from pathfinding3d.finder.a_star import AStarFinder
    except ImportError as problem:
        return absent("time of a query", name, problem)
    grid = Grid(matrix=free.astype(int).tolist())
    start, end = grid.node(*map(int, starts[0])), grid.node(*map(int, goals[0][0]))
    finder = AStarFinder(diagonal_movement=DiagonalMovement.only_when_no_obstacle)
    seconds, _ = cpu_s(lambda: finder.find_path(start, end, grid))
    return row("speed against the peer", seconds / ours, "×", "≥ 1", data, seed, name, 1.0)


# -- tour -----------------------------------------------------------------------------------------------


def tour() -> list[Row]:
    from tasks.planning.tour import tour_cost, visiting_order

    places = np.random.default_rng(3).uniform(0, 100, (500, 3))
    cost = np.linalg.norm(places[:, None] - places[None], axis=2)
    data, seed = "500 points in a cube", "3"

    def order() -> npt.NDArray[np.int64]:
        return visiting_order(np.arange(500), lambda some: cost[np.ix_(some, some)])

    order()
    ours_s, found = cpu_s(order)
    ours = tour_cost(found, cost)
    rows = []
    try:
        import elkai

        peer_s, theirs = cpu_s(lambda: elkai.DistanceMatrix(cost.tolist()).solve_tsp())
        best = tour_cost(np.array(theirs[:-1]), cost)
        rows.append(
            row(
                "tour longer than the peer's",
                100 * (ours / best - 1),
                "%",
                "≤ 3",
                data,
                seed,
                "elkai (LKH)",
                best,
            )
        )
        rows.append(
            row("time against the peer's", ours_s / peer_s, "1", "≤ 0.05", data, seed, "elkai (LKH)", peer_s)
        )
    except ImportError as problem:
        rows.append(absent("tour", "elkai (LKH)", problem))
    try:
        peer_s, length = cpu_s(lambda: ortools_length(cost))
        rows.append(
            row(
                "tour longer than the peer's",
                100 * (ours / length - 1),
                "%",
                None,
                data,
                seed,
                "OR-Tools",
                length,
            )
        )
        rows.append(
            row("time against the peer's", ours_s / peer_s, "1", None, data, seed, "OR-Tools", peer_s)
        )
    except ImportError as problem:
        rows.append(absent("tour", "OR-Tools", problem))
    return rows


def ortools_length(cost: Array) -> float:
    from ortools.constraint_solver import pywrapcp, routing_enums_pb2

    manager = pywrapcp.RoutingIndexManager(len(cost), 1, 0)
    routing = pywrapcp.RoutingModel(manager)
    whole = np.rint(cost * 1000).astype(int)
    number = routing.RegisterTransitCallback(
        lambda a, b: int(whole[manager.IndexToNode(a), manager.IndexToNode(b)])
    )
    routing.SetArcCostEvaluatorOfAllVehicles(number)
    search = pywrapcp.DefaultRoutingSearchParameters()
    search.first_solution_strategy = routing_enums_pb2.FirstSolutionStrategy.PATH_CHEAPEST_ARC
    search.local_search_metaheuristic = routing_enums_pb2.LocalSearchMetaheuristic.GUIDED_LOCAL_SEARCH
    search.time_limit.seconds = 5
    return float(routing.SolveWithParameters(search).ObjectiveValue()) / 1000


# -- coverage -------------------------------------------------------------------------------------------


def coverage() -> list[Row]:
    """The simulator's structures as their true faces, with the position error of the issue."""
    from schemas.camera import Camera
    from schemas.geodesy import GeoOrigin
    from schemas.settings import PlanSettings
    from schemas.vehicle import Vehicle
    from tasks.planning.plan import plan_and_prove
    from tests.benchmarks.planning_scenes import simulated

    camera = Camera(width_px=8192, height_px=5464, focal_px=35e3 / 4.4)  # 45 MP, 35 mm
    vehicle = Vehicle(position_bias_m=0.5, position_jitter_m=0.2)  # its 95 % bound is the paper's 1.5 m
    origin = GeoOrigin(latitude_deg=47.0, longitude_deg=8.0)
    rows = []
    for name in ("bridge", "arch", "facade"):
        structure, points, wanted = simulated(name, 1)
        settings = PlanSettings(gsd_mm_px=0.65, surfaces=wanted)
        made, _ = plan_and_prove(structure, points, camera, vehicle, origin, None, settings)
        data = f"{name}: {len(made.shooting_points)} photos, {len(made.flights)} flights, 200 draws"
        for c in made.coverage:
            reasons = f"{data}; {'; '.join(c.not_reached)}"
            rows.append(row(f"{c.surface}: can be reached", 100 * c.reachable, "%", None, reasons, "1"))
            if c.twice is None or c.twice_median is None or c.twice_p05 is None or c.reachable == 0.0:
                continue
            of = f"{c.surface}: reachable area in two photos"
            rows += [
                row(f"{of}, exact positions", 100 * c.twice, "%", "≥ 99.5", data, "1"),
                row(f"{of}, median of draws", 100 * c.twice_median, "%", "≥ 99", data, "1"),
                row(f"{of}, P05 of draws", 100 * c.twice_p05, "%", "≥ 97", data, "1"),
            ]
    return rows


# -- clearance ------------------------------------------------------------------------------------------


def clearance() -> list[Row]:
    """50 scenes of random boxes round two walls that meet in a corner, paths and axes tested on the boxes'
    own triangles, which the planner never sees."""
    from schemas.camera import Camera
    from schemas.geodesy import GeoOrigin
    from schemas.settings import PlanSettings
    from schemas.vehicle import Vehicle
    from tasks.planning.plan import plan_and_prove
    from tests.benchmarks.planning_scenes import OPEN, Truth, random_scene

    camera = Camera(width_px=1632, height_px=1224, focal_px=4000.0)
    vehicle = Vehicle(clearance_m=0.5, position_bias_m=0.1, position_jitter_m=0.03)
    kept = vehicle.radius_m + vehicle.clearance_m + vehicle.position_error_m
    settings = PlanSettings(gsd_mm_px=1.2, overlap=0.3, free_m=(OPEN,))
    violations, nearest, off = 0, np.inf, []
    for seed in range(50):
        structure, points, boxes = random_scene(seed)
        origin = GeoOrigin(latitude_deg=47.0, longitude_deg=8.0)
        made, _ = plan_and_prove(structure, points, camera, vehicle, origin, None, settings)
        truth = Truth(boxes)
        least = truth.least_distance_m(np.array([w.position_m for w in made.waypoints]))
        nearest = min(nearest, least - kept)
        violations += least < kept - 0.005
        farthest = {c.surface: c.stand_off_m for c in made.coverage}
        for w in made.shooting_points:
            surface = next(s for s in structure.surfaces if s.name == w.surface)
            forward = w.pose.R_world_camera[:, 2]
            cosine = float(-forward @ np.array(surface.plane.normal))
            error = vehicle.position_error_m
            asked = (farthest[surface.name] + error) * cosine - error
            along = float(surface.plane.signed_distance_m(w.position_m)) / cosine
            off.append(abs(along / asked - 1))
    data = "50 scenes, two walls that meet in a corner among 8 boxes"
    return [
        row("scenes with a path closer than the inflation", violations, "1", "≤ 0", data, "0…49"),
        row("least distance beyond the inflation", nearest, "m", None, data, "0…49"),
        row("stand-off off, largest", 100 * max(off), "%", "≤ 5", data, "0…49"),
    ]


# -- the whole ------------------------------------------------------------------------------------------


def bridge() -> list[Row]:
    """Screening a girder bridge: 45 MP, 4.4 µm, 85 mm, 0.3 mm/px."""
    from schemas.camera import Camera
    from schemas.geodesy import GeoOrigin
    from schemas.settings import PlanSettings
    from schemas.vehicle import Vehicle
    from tasks.planning.plan import plan_and_prove
    from tests.benchmarks.planning_scenes import girder_bridge

    camera = Camera(width_px=8192, height_px=5464, focal_px=85e3 / 4.4)
    origin = GeoOrigin(latitude_deg=47.0, longitude_deg=8.0)
    settings = PlanSettings(gsd_mm_px=0.3)
    areas, times = [], []
    made = None
    for length in (3.0, 10.0, 30.0, 90.0):  # the first compiles
        structure, points = girder_bridge(length)
        seconds, (made, _) = cpu_s(
            lambda s=structure, p=points: plan_and_prove(s, p, camera, Vehicle(), origin, None, settings)
        )
        areas.append(sum(s.area_m2 for s in structure.surfaces[1:]))
        times.append(seconds)
    assert made is not None
    exponent = float(np.polyfit(np.log(areas[2:]), np.log(times[2:]), 1)[0])
    gib = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
    data = f"{areas[-1]:.0f} m², {len(made.shooting_points)} photos, {len(made.flights)} flights"
    return [
        row("plan of a 90 m bridge, CPU", times[-1], "s", "≤ 120", data, None),
        row("peak memory", gib, "GiB", "≤ 4", data, None),
        row("exponent of time in area, 30 to 90 m", exponent, "1", "≤ 1.2", data, None),
    ]


# -- mission files --------------------------------------------------------------------------------------


def missions() -> list[Row]:
    """What mavsdk's own importer makes of our files, item by item. It wants a vehicle: the simulated one."""
    import tempfile

    from artifacts.mission_files import write_missions
    from schemas.mission import mission_items
    from tasks.simulation.vehicle import start_vehicle
    from tests.benchmarks.planning_scenes import small_plan

    try:
        from mavsdk import ComponentType, Configuration, Mavsdk
        from mavsdk.plugins.mission_raw import MissionRaw
    except ImportError as problem:
        return [absent("mission import", "mavsdk", problem)]
    plan = small_plan()
    station = Mavsdk(Configuration.create_with_component_type(ComponentType.GROUND_STATION))
    with tempfile.TemporaryDirectory() as folder, start_vehicle(plan, 1) as url:
        write_missions(plan, Path(folder) / "mission")
        station.add_any_connection(url.replace("tcp:", "tcpout://"))
        raw = MissionRaw(station.first_autopilot(20.0))
        imported = (
            raw.import_mission_planner_mission(f"{folder}/mission.waypoints").mission_items,
            raw.import_qgroundcontrol_mission(f"{folder}/mission.plan").mission_items,
        )
    mine = mission_items(plan)[1:]
    rows = []
    for name, found in zip((".waypoints", ".plan"), imported, strict=True):
        homes, theirs = found[: -len(mine)], found[-len(mine) :]  # mavsdk puts a home before the file's own
        differences = sum(one.command != 16 for one in homes) + sum(map(differs, mine, theirs))
        what = f"items of {name} that are read otherwise"
        rows.append(row(what, differences, "1", "≤ 0", f"{len(mine)} items", None, "mavsdk"))
    return rows


def differs(mine: Any, theirs: Any) -> bool:
    """Commands, numbers and places; a frame by its number in files, 3 for 6."""
    frames = {6: (3, 6), 2: (0, 2)}
    numbers = zip(
        (mine.param1, mine.param2, mine.param3, mine.param4, mine.z),
        (theirs.param1, theirs.param2, theirs.param3, theirs.param4, theirs.z),
        strict=True,
    )
    return (
        mine.command != theirs.command
        or theirs.frame not in frames[mine.frame]
        or abs(mine.x - theirs.x) > 1
        or abs(mine.y - theirs.y) > 1
        or any(abs((a or 0.0) - b) > 1e-4 for a, b in numbers)
    )


PARTS = {f.__name__: f for f in (paths, tour, coverage, clearance, bridge, missions)}


def main() -> None:
    from flows.console import out

    chosen = sys.argv[1:] or list(PARTS)
    path = Path("build/bench/planning.json")
    path.parent.mkdir(parents=True, exist_ok=True)
    known: dict[str, list[Row]] = (
        json.loads(path.with_suffix(".parts").read_text())
        if len(sys.argv) > 1 and path.with_suffix(".parts").is_file()
        else {}
    )
    for name in chosen:
        known[name] = PARTS[name]()
        for one in known[name]:
            mark = {True: "holds", False: "MISSED", None: ""}[one["holds"]]
            peer = f"  ({one['peer']}: {one['peer_value']})" if one["peer"] else ""
            value = f"{one['value']} {one['unit']}  {one['bar'] or ''} {mark}"
            out.print(f"{one['what']}: {value}{peer}  [{one['data']}]", markup=False)
        path.with_suffix(".parts").write_text(json.dumps(known))
        path.write_text(json.dumps([one for rows in known.values() for one in rows], indent=1) + "\n")
    out.print(f"\n{path}")


if __name__ == "__main__":
    main()
