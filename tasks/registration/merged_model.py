"""The merged cloud: equal density, normals to the scanner, each point's station; a PLY, tile by tile."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from tasks.registration.cloud_shelf import Shelved
from tasks.registration.rigid_motion import Array, transform
from tasks.registration.station_cloud import facing
from tasks.registration.voxel_grid import Accumulator, Indices, unit, voxel_keys, voxel_sums

TILE = 256  # voxels a side, seen from above; what one tile holds fits into memory
MOST_TILES = 1 << 20  # on either side of zero, along x and y


@dataclass(frozen=True)
class Model:
    """The merged cloud's file, and what it holds."""

    path: Path
    points: int
    low_m: Array  # (3,)
    high_m: Array  # (3,)


def merge(
    clouds: Sequence[Shelved], T_world_local: Sequence[Array], voxel_m: float, folder: Path, path: Path
) -> Model:
    """Write the merged cloud to `path`: one point per voxel and facing, so that both faces of a thin plate
    survive; its station is the one that gave most of its points.

    Binary little-endian PLY: x y z nx ny nz float32, station uchar (ushort from 257 stations on). Each
    station is sorted into tiles in a file of `folder`, then tile after tile is merged.
    """
    sorted_clouds = [
        _Tiled.of(stored, T, voxel_m, folder / f"tiled-{k}.bin")
        for k, (stored, T) in enumerate(zip(clouds, T_world_local, strict=True))
    ]
    table = _table_of(len(clouds))
    low_m, high_m, points = np.full(3, np.inf), np.full(3, -np.inf), 0
    with path.open("wb") as stream:
        stream.write(_header(table, 0))
        for tile in sorted({tile for one in sorted_clouds for tile in one.span}):
            rows = _merged_tile([one.points_of(tile) for one in sorted_clouds], voxel_m, table)
            if len(rows) == 0:
                continue
            rows.tofile(stream)
            points += len(rows)
            xyz = np.column_stack([rows["x"], rows["y"], rows["z"]]).astype(np.float64)
            low_m, high_m = np.minimum(low_m, xyz.min(axis=0)), np.maximum(high_m, xyz.max(axis=0))
        stream.seek(0)
        stream.write(_header(table, points))
    return Model(path, points, low_m, high_m)


@dataclass(frozen=True)
class _Tiled:
    """A station's points and normals, (N, 6) float32 in the world, in a file in the order of their tiles."""

    path: Path
    span: dict[int, tuple[int, int]]  # tile → first row, number of rows

    @classmethod
    def of(cls, stored: Shelved, T_world_local: Array, voxel_m: float, path: Path) -> "_Tiled":
        cloud = stored.cloud()
        points_m = transform(T_world_local, cloud.points_m).astype("<f4")  # as it is read again: same voxel
        normals = (cloud.normals @ T_world_local[:3, :3].T).astype("<f4")
        column = np.floor(points_m[:, :2] / voxel_m).astype(np.int64) // TILE + MOST_TILES
        tile = column[:, 0] * 2 * MOST_TILES + column[:, 1]
        order = np.argsort(tile, kind="stable")
        np.hstack([points_m, normals])[order].tofile(path)
        names, starts, counts = np.unique(tile[order], return_index=True, return_counts=True)
        rows = zip(names.tolist(), starts.tolist(), counts.tolist(), strict=True)
        return cls(path, {name: (start, count) for name, start, count in rows})

    def points_of(self, tile: int) -> npt.NDArray[np.float32]:
        start, count = self.span.get(tile, (0, 0))
        if count == 0:
            return np.empty((0, 6), dtype=np.float32)
        return np.fromfile(self.path, "<f4", 6 * count, offset=24 * start).reshape(count, 6)


def _merged_tile(
    of_stations: Sequence[npt.NDArray[np.float32]], voxel_m: float, table: np.dtype[np.void]
) -> npt.NDArray[np.void]:
    total = Accumulator()
    keys, counts, stations = [], [], []
    for station, values in enumerate(of_stations):
        if len(values) == 0:
            continue
        part = voxel_sums(voxel_keys(values[:, :3], voxel_m, facing(values[:, 3:])), values)
        keys.append(part.keys)
        counts.append(part.counts)
        stations.append(np.full(len(part.keys), station))
        total.add(part)
    means = total.total().means
    rows = np.empty(len(means), table)
    for k, name in enumerate(("x", "y", "z")):
        rows[name] = means[:, k]
    normals = unit(means[:, 3:])
    for k, name in enumerate(("nx", "ny", "nz")):
        rows[name] = normals[:, k]
    rows["station"] = _most(np.concatenate(keys), np.concatenate(counts), np.concatenate(stations))
    return rows


def _most(keys: Indices, counts: Indices, stations: Indices) -> Indices:
    """For each distinct key in order, the station with the highest count, the last of equals."""
    order = np.lexsort((stations, counts, keys))
    return stations[order][np.flatnonzero(np.append(np.diff(keys[order]) > 0, True))]


def _table_of(stations: int) -> np.dtype[np.void]:
    names = ("x", "y", "z", "nx", "ny", "nz")
    return np.dtype([*((name, "<f4") for name in names), ("station", "u1" if stations < 257 else "<u2")])


def _header(table: np.dtype[np.void], points: int) -> bytes:
    """Of the same length for any number of points: the comment makes up for its digits."""
    number = str(points)
    kind = "uchar" if table["station"].itemsize == 1 else "ushort"
    header = "ply\nformat binary_little_endian 1.0\ncomment metres" + " " * (20 - len(number))
    header += f"\nelement vertex {number}\n"
    header += "".join(f"property float {name}\n" for name in (table.names or ())[:6])
    return (header + f"property {kind} station\nend_header\n").encode()
