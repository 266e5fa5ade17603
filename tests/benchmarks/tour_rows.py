"""Rows of `make bench-planning` on the tour of the shooting points, beside other solvers."""

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from tests.benchmarks.table import Row, absent, cpu_s, row

Array = npt.NDArray[np.float64]


def rows() -> list[Row]:
    from tasks.planning.tour import tour_cost, visiting_order

    places = np.random.default_rng(3).uniform(0, 100, (500, 3))
    cost = np.linalg.norm(places[:, None] - places[None], axis=2)
    data, seed = "500 points in a cube", "3"

    def order() -> npt.NDArray[np.int64]:
        return visiting_order(np.arange(500), lambda some: cost[np.ix_(some, some)])

    order()
    ours_s, found = cpu_s(order)
    ours = tour_cost(found, cost)
    table = []
    for name, (solve, longer, slower) in PEERS.items():
        try:
            peer_s, theirs = cpu_s(lambda solve=solve: solve(cost))
        except ImportError as problem:
            table.append(absent("tour", name, problem))
            continue
        excess = 100 * (ours / theirs - 1)
        table.append(row("tour longer than the peer's", excess, "%", longer, data, seed, name, theirs))
        table.append(row("time against the peer's", ours_s / peer_s, "1", slower, data, seed, name, peer_s))
    return table


def elkai_length(cost: Array) -> float:
    import elkai

    from tasks.planning.tour import tour_cost

    return tour_cost(np.array(elkai.DistanceMatrix(cost.tolist()).solve_tsp()[:-1]), cost)


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


PEERS: dict[str, tuple[Callable[[Array], float], str | None, str | None]] = {  # bars of length and time
    "elkai (LKH)": (elkai_length, "≤ 3", "≤ 0.05"),
    "OR-Tools": (ortools_length, None, None),
}
