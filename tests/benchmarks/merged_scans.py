"""A scene's scans as registration hands them over: one cloud at equal density, with normals and scanners."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import small_gicp
from scipy.spatial.transform import Rotation

from schemas.scanning import Scanning
from tasks.simulation.scanner import scan
from tasks.simulation.scene import Scene
from tasks.surfaces.cloud import Cloud, unit
from tasks.surfaces.voxels import voxel_keys

VOXEL_M = 0.02
NEIGHBOURS = 20
LEFT_M, LEFT_DEG = 0.001, 0.001  # what registration leaves in a station's pose, each axis


@dataclass(frozen=True)
class MergedScans:
    cloud: Cloud
    face: npt.NDArray[np.int32]  # (N,) of which face of the scene; negative: see scan_target


def merged_scans(scene: Scene, scanning: Scanning) -> MergedScans:
    """The scans of all stations in the world, each thinned to a point a voxel, poses a little off."""
    rng = np.random.default_rng([scene.seed, 0x4D657267])
    points, normals, views, faces = [], [], [], []
    for sweep in scan(scene, lambda _: None, scanning):
        first = np.unique(voxel_keys(sweep.points.astype(float), VOXEL_M), return_index=True)[1]
        local = sweep.points[first].astype(float)
        cloud = small_gicp.PointCloud(local)
        small_gicp.estimate_normals(cloud, num_neighbors=NEIGHBOURS, num_threads=1)
        across = np.array(cloud.normals())[:, :3]
        across[np.einsum("ni,ni->n", across, local) > 0] *= -1  # to the scanner
        R = (
            Rotation.from_rotvec(np.radians(rng.normal(0, LEFT_DEG, 3))).as_matrix()
            @ sweep.T_world_scan[:3, :3]
        )
        station = sweep.T_world_scan[:3, 3] + rng.normal(0, LEFT_M, 3)
        world = local @ R.T + station
        points.append(world)
        normals.append(across @ R.T)
        views.append(unit(station - world))
        faces.append(sweep.face[first])
    order = np.lexsort(np.concatenate(points).T[::-1])
    cloud = Cloud(*(np.concatenate(part)[order] for part in (points, normals, views)))
    return MergedScans(cloud, np.concatenate(faces)[order])
