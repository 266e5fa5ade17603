"""Other programs' planes of a cloud at equal density, each used as its own documentation has it.

Each gives surfaces and the CPU seconds of its search. Where a program gives points of planes, they get our
outlines, whose time is not counted; planar patches are their own boxes.
"""

import time
from collections.abc import Callable, Sequence
from importlib.util import find_spec

import numpy as np
import numpy.typing as npt
import open3d as o3d

from schemas.plane import Plane
from schemas.settings import SurfaceSettings
from schemas.surface import Surface, in_plane_axes
from tasks.simulation.face import vector
from tasks.surfaces.cloud import Cloud
from tasks.surfaces.extraction import flat_planes
from tasks.surfaces.naming import middle_m
from tasks.surfaces.patches import patches
from tasks.surfaces.plane_fit import fit_plane
from tasks.surfaces.terrain import find_terrain
from tasks.surfaces.voxels import voxelise

SETTINGS = SurfaceSettings()
MOST_PLANES, ITERATIONS, FEWEST = 80, 1000, 100
CLUSTER_M = 0.15  # three voxels: CGAL's neighbours on one plane
PROBABILITY = 0.01  # CGAL's own, of missing the largest plane
Found = tuple[tuple[Surface, ...], float]


def own_search_s(cloud: Cloud) -> float:
    """CPU seconds of our search on the same cloud: ground, planes merged and cut, the points on each."""
    equal = _equal(cloud)
    began = time.process_time()
    flat_planes(equal, find_terrain(equal, SETTINGS.min_area_m2), SETTINGS, lambda _: None)
    return time.process_time() - began


def segment_planes(cloud: Cloud) -> Found:
    """Open3D's segment_plane, again and again on what is left of the cloud."""
    equal = _equal(cloud)
    rest = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(equal.points))
    index = np.arange(len(equal))
    planes = []
    o3d.utility.random.seed(0)
    began = time.process_time()
    while len(planes) < MOST_PLANES and len(index) > FEWEST:
        _, inliers = rest.segment_plane(SETTINGS.distance_m, 3, ITERATIONS)
        if len(inliers) < FEWEST:
            break
        planes.append(index[inliers])
        index = np.delete(index, inliers)
        rest = rest.select_by_index(inliers, invert=True)
    seconds = time.process_time() - began
    return _outlined(equal, planes), seconds


def efficient_ransac(cloud: Cloud) -> Found:
    """CGAL's efficient RANSAC (Schnabel 2007) with our inlier distance and its own other defaults."""
    from CGAL.CGAL_Kernel import Point_3, Vector_3  # of the extra `bench`
    from CGAL.CGAL_Point_set_3 import Point_set_3
    from CGAL.CGAL_Shape_detection import efficient_RANSAC

    equal = _equal(cloud)
    points = Point_set_3()
    points.add_normal_map()
    for place, normal in zip(equal.points.tolist(), equal.normals.tolist(), strict=True):
        points.insert(Point_3(*place), Vector_3(*normal))
    shape_of = points.add_int_map("shape")
    began = time.process_time()
    efficient_RANSAC(points, shape_of, FEWEST, SETTINGS.distance_m, CLUSTER_M, 0.9, PROBABILITY)
    seconds = time.process_time() - began
    shape = np.array([shape_of.get(k) for k in range(len(equal))])
    return _outlined(equal, [np.flatnonzero(shape == k) for k in range(shape.max() + 1)]), seconds


def planar_patches(cloud: Cloud) -> Found:
    """Open3D's detect_planar_patches with its documented settings."""
    equal = _equal(cloud)
    whole = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(equal.points))
    whole.normals = o3d.utility.Vector3dVector(equal.normals)
    began = time.process_time()
    boxes = whole.detect_planar_patches(
        normal_variance_threshold_deg=60,
        coplanarity_deg=75,
        outlier_ratio=0.75,
        min_plane_edge_length=0.0,
        min_num_points=0,
        search_param=o3d.geometry.KDTreeSearchParamKNN(knn=30),
    )
    seconds = time.process_time() - began
    found = []
    for box in boxes:
        thin = int(np.argmin(box.extent))
        wide = [k for k in range(3) if k != thin]
        normal = np.asarray(box.R)[:, thin]
        moved = (equal.points - box.center) @ np.asarray(box.R)
        inside = (np.abs(moved) <= np.asarray(box.extent) / 2 + 0.02).all(axis=1)
        if (equal.views[inside] @ normal).sum() < 0:
            normal = -normal
        u, v = in_plane_axes(normal)
        sides = np.asarray(box.R)[:, wide] * (np.asarray(box.extent)[wide] / 2)
        corners = [sides @ s for s in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
        ring = tuple((float(c @ u), float(c @ v)) for c in corners)
        area_m2 = float(np.prod(np.asarray(box.extent)[wide]))
        if area_m2 >= SETTINGS.min_area_m2:
            found.append(
                Surface(
                    name="patch",
                    plane=Plane.through(box.center, normal),
                    origin_m=vector(box.center),
                    u=u,
                    v=v,
                    outline_m=ring,
                    hull_m=ring,
                    area_m2=area_m2,
                )
            )
    return _without_ground(found), seconds


def _equal(cloud: Cloud) -> Cloud:
    return voxelise(cloud, SETTINGS.voxel_m or 0.05)[0]


def _outlined(equal: Cloud, planes: Sequence[npt.NDArray[np.int64]]) -> tuple[Surface, ...]:
    """A plane seen from both sides is two surfaces, as ours are."""
    found = []
    for own in planes:
        facing = fit_plane(equal.points[own], np.array([0.0, 0.0, 1.0]))[1]
        for sign in (1.0, -1.0):
            side = own[equal.views[own] @ (sign * facing) > 0]
            found += patches(equal.points, side, sign * facing, 0.08, 0.35, SETTINGS.min_area_m2)
    return _without_ground([patch.surface for patch in found])


def _without_ground(found: Sequence[Surface]) -> tuple[Surface, ...]:
    """Peers do not say what is ground; every scene's lies at 0, ± its relief."""
    return tuple(s for s in found if not (s.plane.normal[2] > 0.9 and middle_m(s)[2] < 0.25))


PEERS: dict[str, Callable[[Cloud], Found]] = {
    "Open3D segment_plane": segment_planes,
    "Open3D detect_planar_patches": planar_patches,
    **({"CGAL efficient RANSAC": efficient_ransac} if find_spec("CGAL") else {}),
}
