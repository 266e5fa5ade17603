"""Equal density: one mean point per occupied voxel."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
Indices = npt.NDArray[np.int64]
HALF_SPAN = 1 << 19  # voxels on either side of zero that a key can tell apart


@dataclass(frozen=True)
class VoxelSums:
    """What fell into voxels, in the order of their keys (x, then y, then z, then `extra`)."""

    keys: Indices  # (G,)
    counts: Indices  # (G,)
    sums: Array  # (G, K)

    def plus(self, other: "VoxelSums") -> "VoxelSums":
        return _summed(
            np.concatenate([self.keys, other.keys]),
            np.concatenate([self.counts, other.counts]),
            np.concatenate([self.sums, other.sums]),
        )

    @property
    def means(self) -> Array:
        return np.asarray(self.sums / self.counts[:, None])


def voxel_keys(points_m: npt.NDArray[np.floating], voxel_m: float, extra: Indices | None = None) -> Indices:
    """(N,) numbers of the points' voxels, ordered as x, then y, then z, then `extra` (0…7); −1 for points
    farther from zero than HALF_SPAN voxels (10 km at 2 cm)."""
    cells = np.floor(points_m / voxel_m)
    inside = (np.abs(cells) < HALF_SPAN).all(axis=1)
    cells = np.where(inside[:, None], cells, 0).astype(np.int64) + HALF_SPAN
    key = (((cells[:, 0] << 20) | cells[:, 1]) << 20 | cells[:, 2]) << 3
    if extra is not None:
        key |= extra
    return np.where(inside, key, -1)


def voxel_sums(keys: Indices, values: npt.NDArray[np.floating]) -> VoxelSums:
    """Sums of the (N, K) values of each voxel; values with key −1 are dropped."""
    inside = keys >= 0
    if not inside.all():
        keys, values = keys[inside], values[inside]
    return _summed(keys, np.ones(len(keys), dtype=np.int64), np.asarray(values, dtype=np.float64))


def _summed(keys: Indices, counts: Indices, sums: Array) -> VoxelSums:
    if len(keys) == 0:
        return VoxelSums(keys, counts, sums)
    order = np.argsort(keys, kind="stable")
    keys = keys[order]
    starts = np.flatnonzero(np.append(True, keys[1:] != keys[:-1]))
    return VoxelSums(
        keys[starts], np.add.reduceat(counts[order], starts), np.add.reduceat(sums[order], starts, axis=0)
    )


class Accumulator:
    """Sums of voxels that arrive block by block. Blocks of like size are united first, so that each value is
    moved about as often as a binary logarithm has it."""

    def __init__(self) -> None:
        self._parts: list[VoxelSums] = []

    def add(self, part: VoxelSums) -> None:
        while self._parts and len(self._parts[-1].keys) < 2 * len(part.keys):
            part = self._parts.pop().plus(part)
        self._parts.append(part)

    def total(self) -> VoxelSums:
        """Of at least one part. The parts are given up."""
        part = self._parts.pop()
        while self._parts:
            part = self._parts.pop().plus(part)
        return part


def unit(vectors: npt.NDArray[np.floating]) -> Array:
    """Rows of length one; zero rows stay zero."""
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.asarray(vectors / np.where(length > 1e-12, length, 1.0), dtype=np.float64)
