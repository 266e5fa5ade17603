"""A terrestrial laser scanner: rays cast from tripods around the scene, with a scanner's errors."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt
from scipy.ndimage import gaussian_filter
from scipy.spatial.transform import Rotation

from schemas.contract import Vector3
from tasks.simulation.face import Array, Face, vector
from tasks.simulation.scene import Scene

STEP_DEG = 0.36  # between neighbouring rays, both ways
LOWEST_DEG, HIGHEST_DEG = -55.0, 90.0
RANGE_M = (0.6, 80.0)
RANGE_SIGMA_M = 0.003
ANGLE_SIGMA_DEG = 0.004
STATION_SIGMA_M = 0.05  # of the measured position, each axis
LEVEL_SIGMA_DEG = 0.02  # what the tripod's level leaves
GROUND_RELIEF_M = 0.04
GROUND_CELL_M = 1.0


@dataclass(frozen=True)
class Sweep:
    """One station's scan. points: (N, 3) float32 metres in the scanner's frame."""

    name: str
    points: npt.NDArray[np.float32]
    measured_m: Vector3
    T_world_scan: Array  # (4, 4) true


def scan(scene: Scene, progress: Callable[[float], None]) -> Iterator[Sweep]:
    """Scan the scene from each of its stations; frames are levelled, their yaw is arbitrary."""
    import open3d as o3d  # takes seconds to import

    triangles = _mesh(scene)
    caster = o3d.t.geometry.RaycastingScene(nthreads=1)
    vertices = triangles.reshape(-1, 3).astype(np.float32)
    indices = np.arange(len(vertices), dtype=np.uint32).reshape(-1, 3)
    caster.add_triangles(o3d.core.Tensor.from_numpy(vertices), o3d.core.Tensor.from_numpy(indices))
    for number, station in enumerate(scene.stations_m):
        rng = np.random.default_rng([scene.seed, 0x5363616E, number])
        level = rng.normal(0.0, LEVEL_SIGMA_DEG, 2)
        R = Rotation.from_euler("ZXY", [rng.uniform(0.0, 360.0), *level], degrees=True).as_matrix()
        directions = _directions()
        rays = np.hstack([np.broadcast_to(station, directions.shape), directions @ R.T])
        distance = (
            caster.cast_rays(o3d.core.Tensor.from_numpy(rays.astype(np.float32)))["t_hit"]
            .numpy()
            .astype(float)
        )
        hit = (distance > RANGE_M[0]) & (distance < RANGE_M[1])
        errors = np.radians(ANGLE_SIGMA_DEG) * rng.standard_normal((int(hit.sum()), 3))
        aim = directions[hit] + np.cross(errors, directions[hit])
        measured_range = distance[hit] + rng.normal(0.0, RANGE_SIGMA_M, len(aim))
        T = np.eye(4)
        T[:3, :3], T[:3, 3] = R, station
        yield Sweep(
            name=f"station-{number + 1}",
            points=(aim * measured_range[:, None]).astype(np.float32),
            measured_m=vector(np.asarray(station) + rng.normal(0.0, STATION_SIGMA_M, 3)),
            T_world_scan=T,
        )
        progress((number + 1) / len(scene.stations_m))


def write_ply(points: npt.NDArray[np.float32], path: Path) -> None:
    """Binary PLY of (N, 3) float32 points."""
    header = (
        "ply\nformat binary_little_endian 1.0\ncomment metres, scanner's own frame\n"
        f"element vertex {len(points)}\nproperty float x\nproperty float y\nproperty float z\nend_header\n"
    )
    path.write_bytes(header.encode("ascii") + np.ascontiguousarray(points, dtype="<f4").tobytes())


def _directions() -> Array:
    azimuth = np.radians(np.arange(0.0, 360.0, STEP_DEG))
    elevation = np.radians(np.arange(LOWEST_DEG, HIGHEST_DEG, STEP_DEG))
    a, e = (g.ravel() for g in np.meshgrid(azimuth, elevation))
    return np.column_stack([np.sin(a) * np.cos(e), np.cos(a) * np.cos(e), np.sin(e)])


def _mesh(scene: Scene) -> Array:
    """(N, 3, 3) triangles: two a face; the ground as a fine grid with relief."""
    flat = [f.corners_m[[[0, 1, 2], [0, 2, 3]]] for f in scene.faces if f.material != "ground"]
    return np.concatenate([*flat, *(_relief(scene, f) for f in scene.faces if f.material == "ground")])


def _relief(scene: Scene, ground: Face) -> Array:
    """(N, 3, 3) triangles of uneven ground."""
    rng = np.random.default_rng([scene.seed, 0x47726E64])
    columns, rows = (round(side / GROUND_CELL_M) + 1 for side in (ground.width_m, ground.height_m))
    bumps = gaussian_filter(rng.standard_normal((rows, columns)), 1.5)
    v, u = np.mgrid[:rows, :columns] * GROUND_CELL_M
    points = ground.to_world(np.column_stack([u.ravel(), v.ravel()]))
    points += np.outer(bumps.ravel() / bumps.std() * GROUND_RELIEF_M, ground.normal)
    grid = points.reshape(rows, columns, 3)
    a, b, c, d = grid[:-1, :-1], grid[:-1, 1:], grid[1:, 1:], grid[1:, :-1]
    lower = np.stack([a, b, c], axis=2).reshape(-1, 3, 3)
    upper = np.stack([a, c, d], axis=2).reshape(-1, 3, 3)
    return np.concatenate([lower, upper])
