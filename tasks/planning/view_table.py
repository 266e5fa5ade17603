"""Which samples of a surface each photo can show, found once and used for every draw of the position."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

from schemas.camera import Camera, CameraPose
from schemas.surface import Surface
from tasks.planning.sight import Scene

Array = npt.NDArray[np.float64]
Flags = npt.NDArray[np.bool_]
Indices = npt.NDArray[np.int64]

RAYS_AT_ONCE = 400_000
# (7, 3): the planned place and one off along each axis of the surface's frame, either way.
AROUND = np.vstack([np.zeros(3), np.eye(3), -np.eye(3)])
FROM_SIGMA = 1.5  # of the position error: how far off what hides a sample is looked for


@dataclass(frozen=True)
class ViewTable:
    """Photo p may show the samples samples[first[p]:first[p + 1]]; visible says for each of these from which
    of the seven places around its planned one (`AROUND`) nothing hides it."""

    eyes_m: Array  # (P, 3)
    R_world_camera: Array  # (P, 3, 3)
    around_m: Array  # (7, 3) world: the places that `visible` is known from, less the planned one
    first: Indices  # (P + 1,)
    samples: Indices  # (K,)
    visible: Flags  # (7, K)


def view_table(
    surface: Surface,
    camera: Camera,
    poses: Sequence[CameraPose],
    points_m: Array,
    scene: Scene,
    sigma_m: float,
) -> ViewTable:
    """points_m: (N, 3) samples of the surface. sigma_m: of the position error along an axis; 0 for none."""
    tree = cKDTree(points_m)
    right, bottom = camera.width_px - 0.5, camera.height_px - 0.5
    corners = np.array([(-0.5, -0.5), (right, -0.5), (-0.5, bottom), (right, bottom)])
    level = CameraPose(position_m=(0.0, 0.0, 0.0), yaw_deg=0.0, pitch_deg=0.0)
    corner_rays = camera.back_project(corners, level) @ level.R_world_camera  # in the camera's own frame
    found = [_near(tree, surface, pose, corner_rays, 4.0 * sigma_m) for pose in poses]
    first = np.concatenate([[0], np.cumsum([len(f) for f in found])]).astype(np.int64)
    samples = np.concatenate([*found, np.empty(0, dtype=np.int64)])
    eyes = np.array([pose.position_m for pose in poses]).reshape(-1, 3)
    eye_of = np.repeat(np.arange(len(poses)), np.diff(first))
    around = AROUND @ surface.R_world_surface.T * FROM_SIGMA * sigma_m
    places = around if sigma_m > 0 else around[:1]
    visible = np.ones((len(AROUND), len(samples)), dtype=bool)
    for low in range(0, len(samples), RAYS_AT_ONCE):
        part = slice(low, low + RAYS_AT_ONCE)
        for k, offset in enumerate(places):
            visible[k, part] = scene.sees(eyes[eye_of[part]] + offset, points_m[samples[part]])
    if len(places) == 1:
        visible[:] = visible[0]
    turns = np.array([pose.R_world_camera for pose in poses]).reshape(-1, 3, 3)
    return ViewTable(eyes, turns, around, first, samples, visible)


def _near(tree: cKDTree, surface: Surface, pose: CameraPose, corner_rays: Array, stray_m: float) -> Indices:
    """Samples inside the circle around what the photo shows of the surface's plane, however it strays."""
    rays = corner_rays @ pose.R_world_camera.T
    eye = np.asarray(pose.position_m)
    towards = rays @ np.asarray(surface.plane.normal)
    height = float(surface.plane.signed_distance_m(eye)[()])
    if height <= 0 or (towards >= -0.05).any():  # an edge of the photo looks along the surface
        return np.arange(tree.n)
    shown = eye - rays * (height / towards)[:, None]
    middle = shown.mean(axis=0)
    radius = float(np.linalg.norm(shown - middle, axis=1).max())
    near = tree.query_ball_point(middle, radius + stray_m)
    return np.sort(np.asarray(near, dtype=np.int64))
