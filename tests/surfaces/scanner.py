"""Ground truth for the tests: boxes scanned by ray casting, with range noise and occlusion."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import open3d as o3d

from tasks.surfaces.cloud import Cloud, unit
from tasks.surfaces.voxels import voxel_keys

Floats = npt.NDArray[np.float64]
FARTHEST_M = 40.0


@dataclass(frozen=True)
class Box:
    min_m: tuple[float, float, float]
    max_m: tuple[float, float, float]


def scan(
    boxes: list[Box],
    stations_m: list[tuple[float, float, float]],
    step_deg: float = 0.5,
    noise_m: float = 0.003,
    seed: int = 0,
    voxel_m: float = 0.02,
) -> Cloud:
    """What registration hands over: one point per 2 cm voxel and station, normals from 12 neighbours."""
    scene = _scene(boxes)
    rng = np.random.default_rng(seed)
    clouds = [_station(scene, np.asarray(place), step_deg, noise_m, voxel_m, rng) for place in stations_m]
    return Cloud(
        *(np.concatenate([getattr(c, part) for c in clouds]) for part in ("points", "normals", "views"))
    )


def in_view(boxes: list[Box], stations_m: list[tuple[float, float, float]], points_m: Floats) -> Floats:
    """(N,) 1 where one of the stations sees the point, else 0."""
    scene = _scene(boxes)
    seen = np.zeros(len(points_m))
    for place in stations_m:
        ray = points_m - np.asarray(place)
        cast = np.column_stack([np.broadcast_to(place, ray.shape), ray]).astype(np.float32)
        seen[scene.cast_rays(o3d.core.Tensor(cast))["t_hit"].numpy() > 0.999] = 1.0
    return seen


def _scene(boxes: list[Box]) -> o3d.t.geometry.RaycastingScene:
    scene = o3d.t.geometry.RaycastingScene()
    for box in boxes:
        mesh = o3d.geometry.TriangleMesh.create_box(*np.subtract(box.max_m, box.min_m))
        mesh.translate(box.min_m)
        scene.add_triangles(o3d.t.geometry.TriangleMesh.from_legacy(mesh))
    return scene


def _station(
    scene: o3d.t.geometry.RaycastingScene,
    place: Floats,
    step_deg: float,
    noise_m: float,
    voxel_m: float,
    rng: np.random.Generator,
) -> Cloud:
    phase_deg = rng.uniform(0, step_deg, 2)
    angles = np.meshgrid(np.arange(0, 360, step_deg), np.arange(-60, 85, step_deg), indexing="ij")
    azimuth, elevation = (np.radians(angle + phase) for angle, phase in zip(angles, phase_deg, strict=True))
    rays = np.stack(
        [np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)], -1
    ).reshape(-1, 3)
    cast = np.column_stack([np.broadcast_to(place, rays.shape), rays]).astype(np.float32)
    range_m = scene.cast_rays(o3d.core.Tensor(cast))["t_hit"].numpy().astype(float)
    hit = range_m < FARTHEST_M
    points = place + rays[hit] * (range_m[hit] + rng.normal(0.0, noise_m, hit.sum()))[:, None]
    points = points[np.unique(voxel_keys(points, voxel_m), return_index=True)[1]]
    cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points))
    cloud.estimate_normals(o3d.geometry.KDTreeSearchParamKNN(12))
    cloud.orient_normals_towards_camera_location(place)
    return Cloud(points, np.asarray(cloud.normals), unit(place - points))
