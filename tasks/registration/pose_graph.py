"""All stations' poses at once: the least-squares compromise between all pairs, wrong pairs voted down."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tasks.registration.rigid_motion import Array, adjoint, exp, inverse, log, orthonormal, pose

ITERATIONS = 50
SHARED = 16  # points of the fine alignment in a coarse voxel of a surface: much the same errors
LEAST_SCALE_M = 0.003  # pairs that contradict the rest by less are all kept


@dataclass(frozen=True)
class Edge:
    source: int
    target: int
    T_target_source: Array
    information: Array  # (6, 6), ξ on the left in the target's frame; ξᵀ(information)ξ / inliers is m²
    inliers: int
    rmse_m: float  # of the inliers


def optimise(T_start: Sequence[Array], edges: Sequence[Edge]) -> tuple[list[Array], list[float]]:
    """(poses T_frame_station, disagreement of each edge in metres) by Gauss-Newton with Geman and McClure's
    robust loss (iteratively reweighted); the first pose stays.

    An edge's disagreement is the RMS distance by which its points would leave their planes if the edge were
    forced into the graph: its ξ weighed by its own information. Fifty stations are three hundred unknowns,
    so the normal equations are solved dense. Every station must be reached by edges.
    """
    if not connected(len(T_start), edges):
        raise ValueError("the pose graph is not connected")
    T = list(T_start)
    mean_inliers = float(np.mean([edge.inliers for edge in edges])) if edges else 1.0
    for _ in range(ITERATIONS if len(T) > 1 else 0):
        A, b, _ = _normal_equations(T, edges, mean_inliers)
        free = slice(6, None)
        damping = 1e-9 * float(np.trace(A)) / len(A)
        step = np.asarray(np.linalg.solve(A[free, free] + damping * np.eye(len(A) - 6), b[free])).reshape(
            -1, 6
        )
        for k, xi in enumerate(step, start=1):
            T[k] = orthonormal(exp(xi) @ T[k])
        if np.abs(step).max() < 1e-9:
            break
    return T, [_apart_m(_error(T, edge), edge) for edge in edges]


def covariances(
    T_frame_station: Sequence[Array], edges: Sequence[Edge], scanner_m: Sequence[Array]
) -> list[Array]:
    """(6, 6) of each station: turn (radians) and shift (metres) of its scanner (at (3,) `scanner_m`,
    about the frame's axes), relative to all stations together (a free network: none is fixed).

    The variance of a pair's distances is what the loops close to (unit weight a posteriori). Where there are
    none, it is what the pairs leave, as often as points share their errors. Only one station: zeros.
    """
    n = len(T_frame_station)
    if n == 1:
        return [np.zeros((6, 6))]
    A, _, square = _normal_equations(T_frame_station, edges, 1.0)
    redundant = 6 * (len(edges) - n + 1)
    left_m2 = float(np.mean([edge.rmse_m**2 for edge in edges]))
    variance_m2 = square / redundant if redundant else SHARED * left_m2
    free = slice(6, None)
    C = np.zeros_like(A)
    C[free, free] = variance_m2 * np.linalg.inv(
        A[free, free] + 1e-12 * np.trace(A) / len(A) * np.eye(6 * n - 6)
    )
    to_scanner = np.zeros_like(A)
    common = np.zeros((6 * n, 6))  # how all stations move together
    weight = np.zeros(6 * n)
    centre_m = np.mean(scanner_m, axis=0)
    size_m = max(1.0, float(np.linalg.norm(np.array(scanner_m) - centre_m, axis=1).mean()))
    for k, place_m in enumerate(scanner_m):
        at = slice(6 * k, 6 * k + 6)
        to_scanner[at, at] = common[at] = adjoint(pose(np.eye(3), -place_m))
        weight[at] = np.array([size_m**2] * 3 + [1.0] * 3)
    weighted = common.T * weight
    spread = np.eye(6 * n) - common @ np.linalg.solve(weighted @ common, weighted)
    C = spread @ to_scanner @ C @ to_scanner.T @ spread.T
    return [C[6 * k : 6 * k + 6, 6 * k : 6 * k + 6] for k in range(n)]


def spanning_start(stations: int, edges: Sequence[Edge]) -> list[Array]:
    """Poses chained along the strongest edges from the first station."""
    T: dict[int, Array] = {0: np.eye(4)}
    while len(T) < stations:
        usable = [e for e in edges if (e.source in T) != (e.target in T)]
        edge = max(usable, key=lambda e: (e.inliers, -e.source, -e.target))
        if edge.target in T:
            T[edge.source] = T[edge.target] @ edge.T_target_source
        else:
            T[edge.target] = T[edge.source] @ inverse(edge.T_target_source)
    return [T[k] for k in range(stations)]


def connected(stations: int, edges: Sequence[Edge]) -> bool:
    return len(component(0, edges)) == stations


def component(start: int, edges: Sequence[Edge]) -> set[int]:
    """Stations that edges tie to `start`, itself included."""
    reached = {start}
    while True:
        more = {s for e in edges if reached & {e.source, e.target} for s in (e.source, e.target)} - reached
        if not more:
            return reached
        reached |= more


def _normal_equations(T: Sequence[Array], edges: Sequence[Edge], unit: float) -> tuple[Array, Array, float]:
    """(6n, 6n) and (6n,) for ξ on the left of each pose, information in `unit`s; weighted sum of squares."""
    errors = [_error(T, edge) for edge in edges]
    apart_m = np.array([_apart_m(e, edge) for e, edge in zip(errors, edges, strict=True)])
    scale_m = max(3 * float(np.median(apart_m)), LEAST_SCALE_M)
    weights = (scale_m**2 / (scale_m**2 + apart_m**2)) ** 2
    A = np.zeros((6 * len(T), 6 * len(T)))
    b = np.zeros(6 * len(T))
    square = 0.0
    for e, edge, weight in zip(errors, edges, weights, strict=True):
        J = adjoint(inverse(T[edge.target]))
        H = J.T @ edge.information @ J * (weight / unit)
        g = J.T @ edge.information @ e * (weight / unit)
        square += float(e @ edge.information @ e) * weight / unit
        i, j = slice(6 * edge.target, 6 * edge.target + 6), slice(6 * edge.source, 6 * edge.source + 6)
        A[i, i] += H
        A[j, j] += H
        A[i, j] -= H
        A[j, i] -= H
        b[i] += g
        b[j] -= g
    return A, b, square


def _error(T: Sequence[Array], edge: Edge) -> Array:
    """ξ with inverse(T_target) T_source = exp(ξ) T_target_source."""
    return log(inverse(T[edge.target]) @ T[edge.source] @ inverse(edge.T_target_source))


def _apart_m(error: Array, edge: Edge) -> float:
    return float(np.sqrt(max(float(error @ edge.information @ error), 0.0) / edge.inliers))
