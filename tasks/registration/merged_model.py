"""The merged cloud: equal density, normals to the scanner, the station of each point; as PLY."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from tasks.registration.rigid_motion import Array, transform
from tasks.registration.station_cloud import Cloud, facing
from tasks.registration.voxel_grid import group_means, unit, voxel_groups


@dataclass(frozen=True)
class Model:
    points_m: npt.NDArray[np.float32]  # (N, 3) world
    normals: npt.NDArray[np.float32]  # (N, 3) unit
    station: npt.NDArray[np.int64]  # (N,) which station gave most of the voxel's points


def merge(clouds: Sequence[Cloud], T_world_local: Sequence[Array], voxel_m: float) -> Model:
    """One point per voxel and facing, so that both faces of a thin plate survive."""
    points_m = np.concatenate([transform(T, c.points_m) for c, T in zip(clouds, T_world_local, strict=True)])
    normals = np.concatenate([c.normals @ T[:3, :3].T for c, T in zip(clouds, T_world_local, strict=True)])
    station = np.repeat(np.arange(len(clouds)), [len(c) for c in clouds])
    groups = voxel_groups(points_m, voxel_m, facing(normals))
    counts = np.unique(groups * len(clouds) + station, return_counts=True)
    by_count = np.lexsort((counts[0] % len(clouds), counts[1], counts[0] // len(clouds)))
    group_of = counts[0][by_count] // len(clouds)
    last = np.flatnonzero(np.append(np.diff(group_of) > 0, True))
    return Model(
        group_means(points_m, groups).astype(np.float32),
        unit(group_means(normals, groups)).astype(np.float32),
        (counts[0][by_count] % len(clouds))[last],
    )


def write_model(model: Model, path: Path) -> None:
    """Binary little-endian PLY: x y z nx ny nz float32, station uchar (ushort from 256 stations on)."""
    kind, dtype = ("uchar", "u1") if model.station.max(initial=0) < 256 else ("ushort", "<u2")
    names = ("x", "y", "z", "nx", "ny", "nz")
    table = np.empty(len(model.points_m), np.dtype([*((name, "<f4") for name in names), ("station", dtype)]))
    for k, name in enumerate(names):
        table[name] = (model.points_m if k < 3 else model.normals)[:, k % 3]
    table["station"] = model.station
    header = "ply\nformat binary_little_endian 1.0\ncomment metres\n"
    header += f"element vertex {len(table)}\n"
    header += "".join(f"property float {name}\n" for name in names)
    header += f"property {kind} station\nend_header\n"
    with path.open("wb") as stream:
        stream.write(header.encode())
        table.tofile(stream)
