"""Where a scanner stood, judged by what it saw: from its place there is one range in most directions.

Files say little of it. A scan in its scanner's own frame has it at (0, 0, 0), one exported in a site's frame
does not, and a merged cloud has no such place at all.
"""

from collections.abc import Sequence

import numpy as np

from tasks.registration.rigid_motion import Array

LOOK_DEG = 1.5  # cells of a view
ONE_RANGE = (
    0.75  # of all points, in cells of one range: ≥ 0.82 from a scanner's place, ≤ 0.64 elsewhere in it
)
AS_GOOD = 0.10  # less of them than from the likely place: it stood there rather
FARTHEST_OFF = 2.0  # times the cloud's extent; from far away all that there is lies in one direction
JUDGED = 100_000  # points
AROUND_M = 5.0  # of the likely place lies what it stood on,
LOWEST_PERCENT = 5.0  # lowest there; below are echoes of puddles
TRIPOD_M = 1.7


def standpoint(points_m: Array, candidates_m: Sequence[Array]) -> Array | None:
    """The first (3,) of the candidates from where all of one scan's (N, 3) points can have been seen."""
    seen = points_m[:: max(1, len(points_m) // JUDGED)]
    likely = _one_range(seen, _middle(seen))
    for place_m in candidates_m:
        if _one_range(seen, place_m) >= max(ONE_RANGE, likely - AS_GOOD):
            return place_m
    return None


def likely_standpoint(points_m: Array) -> Array | None:
    """(3,) the place in the middle of what a scan saw, above the ground there; None for a cloud that was not
    seen from one place. Within 1.5 m of the true one on simulated and real scans: it tells sides."""
    seen = points_m[:: max(1, len(points_m) // JUDGED)]
    middle_m = _middle(seen)
    return middle_m if _one_range(seen, middle_m) >= ONE_RANGE else None


def _middle(points_m: Array) -> Array:
    plan_m = np.median(points_m[:, :2], axis=0)
    around = np.linalg.norm(points_m[:, :2] - plan_m, axis=1) < AROUND_M
    floor_m = np.percentile(points_m[around, 2] if around.any() else points_m[:, 2], LOWEST_PERCENT)
    return np.array([*plan_m, floor_m + TRIPOD_M])


def _one_range(points_m: Array, place_m: Array) -> float:
    """Share of the points that lie in directions with one range; 0 from a place far off."""
    ray_m = points_m - place_m
    range_m = np.linalg.norm(ray_m, axis=1)
    low_m, high_m = np.percentile(points_m, [1, 99], axis=0)
    if np.percentile(range_m, 1) > FARTHEST_OFF * np.linalg.norm(high_m - low_m):
        return 0.0
    level = np.degrees(np.arcsin(np.clip(ray_m[:, 2] / np.maximum(range_m, 1e-9), -1.0, 1.0)))
    turn = np.degrees(np.arctan2(ray_m[:, 1], ray_m[:, 0]))
    cell = np.floor(level / LOOK_DEG).astype(np.int64) * 1000 + np.floor(turn / LOOK_DEG).astype(np.int64)
    order = np.lexsort((range_m, cell))
    first = np.flatnonzero(np.diff(cell[order], prepend=-(2**62)))
    end = np.append(first[1:], len(order))
    nearest_m, farthest_m = range_m[order][first], range_m[order][end - 1]
    single = farthest_m - nearest_m < 0.1 * nearest_m + 1.0
    return float((end - first)[single].sum()) / len(points_m)
