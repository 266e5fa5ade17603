"""Other programs' registration of two scans, each used as its own documentation has it."""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from typing import Any

import numpy as np
import open3d as o3d
import small_gicp

from tasks.registration.rigid_motion import Array, inverse, pose

CORES = 1
VOXELS_M = (0.4, 0.2, 0.1)  # of Open3D's multi-scale ICP, coarse to fine
registration = o3d.pipelines.registration


@dataclass(frozen=True)
class Gicp:
    """small_gicp: a cloud is prepared once, each edge aligned once. The first setting is its default, the
    second one at which its edges of the bridge are good to millimetres."""

    downsampling_m: float
    reach_m: float

    @property
    def name(self) -> str:
        return f"small_gicp {self.downsampling_m:g}/{self.reach_m:g} m"

    def prepared(self, points_m: Array) -> tuple[Any, Any]:
        cloud, tree = small_gicp.preprocess_points(points_m, self.downsampling_m, num_threads=CORES)
        return cloud, tree

    def aligned(self, source: tuple[Any, Any], target: tuple[Any, Any], T_start: Array) -> Any:
        return small_gicp.align(
            target[0],
            source[0],
            target[1],
            init_T_target_source=T_start,
            max_correspondence_distance=self.reach_m,
            num_threads=CORES,
        )

    def pair(self, source_m: Array, target_m: Array, T_start: Array) -> Array:
        found = self.aligned(self.prepared(source_m), self.prepared(target_m), T_start)
        return np.asarray(found.T_target_source)


PLAIN, FINE = Gicp(0.25, 1.0), Gicp(0.05, 0.25)


def multi_scale_icp(source_m: Array, target_m: Array, T_start: Array) -> Array:
    """Open3D's robust point-to-plane ICP (Tukey), coarse to fine."""
    T = T_start
    for voxel_m in VOXELS_M:
        source, target = (_thinned(points_m, voxel_m) for points_m in (source_m, target_m))
        loss = registration.TransformationEstimationPointToPlane(registration.TukeyLoss(k=voxel_m))
        criteria = registration.ICPConvergenceCriteria(max_iteration=50)
        T = registration.registration_icp(source, target, 2 * voxel_m, T, loss, criteria).transformation
    return np.asarray(T)


def ransac(source_m: Array, target_m: Array, voxel_m: float) -> Array:
    """Open3D's FPFH features and RANSAC, as its tutorial on global registration has them."""
    (source, source_f), (target, target_f) = (_with_features(p, voxel_m) for p in (source_m, target_m))
    o3d.utility.random.seed(0)
    reach_m = 1.5 * voxel_m
    return np.asarray(
        registration.registration_ransac_based_on_feature_matching(
            source,
            target,
            source_f,
            target_f,
            True,
            reach_m,
            registration.TransformationEstimationPointToPoint(False),
            3,
            [
                registration.CorrespondenceCheckerBasedOnEdgeLength(0.9),
                registration.CorrespondenceCheckerBasedOnDistance(reach_m),
            ],
            registration.RANSACConvergenceCriteria(100_000, 0.999),
        ).transformation
    )


def fgr(source_m: Array, target_m: Array, voxel_m: float) -> Array:
    """Open3D's fast global registration, as its tutorial has it."""
    (source, source_f), (target, target_f) = (_with_features(p, voxel_m) for p in (source_m, target_m))
    option = registration.FastGlobalRegistrationOption(maximum_correspondence_distance=0.5 * voxel_m)
    return np.asarray(
        registration.registration_fgr_based_on_feature_matching(
            source, target, source_f, target_f, option
        ).transformation
    )


def kiss(source_m: Array, target_m: Array, voxel_m: float) -> Array:
    """KISS-Matcher with its own defaults."""
    import kiss_matcher  # of the extra `bench`

    matcher = kiss_matcher.KISSMatcher(kiss_matcher.KISSMatcherConfig(voxel_m))
    found = matcher.estimate(source_m.astype(np.float32), target_m.astype(np.float32))
    return pose(np.asarray(found.rotation), np.asarray(found.translation))


BLIND: dict[str, Callable[[Array, Array, float], Array]] = {
    "Open3D FPFH-RANSAC": ransac,
    "Open3D FGR": fgr,
    **({"KISS-Matcher": kiss} if find_spec("kiss_matcher") else {}),
}


def edges_of(
    gicp: Gicp, scans_m: dict[str, Array], pairs: Sequence[tuple[str, str, Array]]
) -> tuple[list[Array], float]:
    """(T_target_source of each pair (source, target, T_start), CPU seconds)."""
    began = time.process_time()
    clouds = {name: gicp.prepared(points_m) for name, points_m in scans_m.items()}
    found = [gicp.aligned(clouds[s], clouds[t], T).T_target_source for s, t, T in pairs]
    return [np.asarray(T) for T in found], time.process_time() - began


def apart(T: Array, truth: Array, points_m: Array) -> float:
    """RMS distance in metres of (N, 3) points moved by either."""
    delta = (inverse(truth) @ T - np.eye(4))[:3]
    return float(np.sqrt(((points_m @ delta[:, :3].T + delta[:, 3]) ** 2).sum(axis=1).mean()))


def _thinned(points_m: Array, voxel_m: float) -> Any:
    cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points_m)).voxel_down_sample(voxel_m)
    cloud.estimate_normals(o3d.geometry.KDTreeSearchParamHybrid(2 * voxel_m, 30))
    return cloud


def _with_features(points_m: Array, voxel_m: float) -> tuple[Any, Any]:
    cloud = _thinned(points_m, voxel_m)
    around = o3d.geometry.KDTreeSearchParamHybrid(5 * voxel_m, 100)
    return cloud, registration.compute_fpfh_feature(cloud, around)
