"""Coarse alignment of a levelled scanner whose position is known: only its yaw is searched."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.ndimage import distance_transform_edt

from tasks.registration.rigid_motion import Array, transform, yaw

MOST_CELLS = 3_000_000
HIGHEST_M = 6.0  # scanners of one site stand within this height of each other


@dataclass(frozen=True)
class DistanceField:
    """Distance to the nearest point, on a grid, cut off at `reach_m`."""

    low_m: Array  # (3,)
    cell_m: float
    reach_m: float
    distance_m: npt.NDArray[np.float32]  # (X, Y, Z)

    @classmethod
    def of(cls, points_m: npt.NDArray[np.floating], cell_m: float, reach_m: float) -> "DistanceField":
        low_m, high_m = np.percentile(points_m, [0.5, 99.5], axis=0)
        low_m, high_m = low_m - reach_m, high_m + reach_m
        cell_m = max(cell_m, float(np.prod(high_m - low_m) / MOST_CELLS) ** (1 / 3))
        shape = np.ceil((high_m - low_m) / cell_m).astype(int) + 1
        empty: npt.NDArray[np.bool_] = np.ones(tuple(shape), dtype=bool)
        cells = np.floor((points_m - low_m) / cell_m).astype(int)
        inside = ((cells >= 0) & (cells < shape)).all(axis=1)
        empty[tuple(cells[inside].T)] = False
        distance = distance_transform_edt(empty).astype(np.float32) * np.float32(cell_m)
        return cls(low_m, cell_m, reach_m, np.minimum(distance, np.float32(reach_m)))

    def closeness(self, points_m: Array) -> npt.NDArray[np.float32]:
        """1 on a point, 0 from `reach_m` on; of (…, 3) points."""
        cells = np.floor((points_m - self.low_m) / self.cell_m).astype(np.int32)
        shape = np.array(self.distance_m.shape, dtype=np.int32)
        inside = np.asarray(((cells >= 0) & (cells < shape)).all(axis=-1))
        cells = np.where(inside[..., None], cells, 0)
        distance = self.distance_m[cells[..., 0], cells[..., 1], cells[..., 2]]
        return np.where(inside, 1 - distance / np.float32(self.reach_m), np.float32(0))

    def settled(self, T_field_source: Array, source_m: Array) -> Array:
        """T moved up or down, and a little aside, to where the source comes nearest."""
        heights_m = np.arange(-HIGHEST_M, HIGHEST_M + 1e-9, self.reach_m / 4)
        aside_m = np.arange(-self.reach_m / 2, self.reach_m / 2 + 1e-9, self.reach_m / 8)
        T = T_field_source.copy()
        for axis, steps_m in ((2, heights_m), (0, aside_m), (1, aside_m), (0, aside_m), (2, heights_m)):
            moved, along = transform(T, source_m), np.eye(3)[axis]
            scores = [float(self.closeness(moved + step * along).mean()) for step in steps_m]
            T[axis, 3] += steps_m[int(np.argmax(scores))]
        return T


def turns(
    field: DistanceField, source_m: Array, position_m: Array, step_deg: float, best: int
) -> list[tuple[float, Array]]:
    """The `best` (score, T_field_source) of all yaws of a scanner that stands at `position_m`."""
    angles = np.radians(np.arange(0.0, 360.0, step_deg))
    scores = np.array(
        [field.closeness(source_m @ yaw(a)[:3, :3].T + position_m).mean() for a in angles], dtype=float
    )
    return [(float(scores[k]), yaw(angles[k], position_m)) for k in _peaks(scores[None], best)[1]]


def turns_about(
    field: DistanceField, source_m: Array, baseline_m: Array, step_deg: float, best: int
) -> list[tuple[float, Array]]:
    """As `turns`, but of the scanner's position only its offset from the field's own scanner is known, up
    to the unknown yaw of that one: both yaws are searched."""
    angles = np.radians(np.arange(0.0, 360.0, step_deg))
    turned = np.stack([source_m @ yaw(a)[:3, :3].T for a in angles])
    scores = np.stack(
        [field.closeness(turned + yaw(a)[:3, :3] @ baseline_m).mean(axis=1) for a in angles]
    ).astype(float)
    rows, columns = _peaks(scores, best)
    return [
        (float(scores[i, j]), yaw(angles[j], yaw(angles[i])[:3, :3] @ baseline_m))
        for i, j in zip(rows, columns, strict=True)
    ]


def _peaks(scores: Array, best: int) -> tuple[list[int], list[int]]:
    """Row and column of the highest scores that do not neighbour each other; both axes are circular."""
    left = scores.copy()
    rows: list[int] = []
    columns: list[int] = []
    for _ in range(best):
        i, j = np.unravel_index(int(left.argmax()), left.shape)
        if not np.isfinite(left[i, j]):
            break
        rows.append(int(i))
        columns.append(int(j))
        near_i = np.arange(i - 3, i + 4) % left.shape[0]
        near_j = np.arange(j - 3, j + 4) % left.shape[1]
        left[np.ix_(near_i, near_j)] = -np.inf
    return rows, columns
