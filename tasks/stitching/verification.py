"""Is this a match of two photos? RANSAC homography, then the paper's rule (Brown & Lowe 2007, eq. 13)."""

from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

from schemas.camera import Camera
from tasks.stitching.matching import Matches
from tasks.stitching.view import Array

Points = npt.NDArray[np.float32]  # (N, 2) undistorted pixels

REFERENCE_PX = 2.0e6  # the inlier distance is stated for a photo of this many pixels, and grows with it


@dataclass(frozen=True)
class Verified:
    H: Array  # (3, 3) undistorted pixels of a to those of b
    inliers: Matches
    overlapping: int  # n_f: matches in the area where both photos overlap

    @property
    def holds(self) -> bool:
        """n_i > 8 + 0.3 n_f."""
        return len(self.inliers) > 8.0 + 0.3 * self.overlapping


def tolerance_px(camera: Camera, ransac_px: float) -> float:
    """Features of large photos are found on smaller copies, and placed accordingly."""
    return ransac_px * max(1.0, float(np.sqrt(camera.width_px * camera.height_px / REFERENCE_PX)))


def verify(xy_a: Points, xy_b: Points, matches: Matches, camera: Camera, within_px: float) -> Verified | None:
    """None where no homography a camera could see carries the matches. Seeded: same input, same result."""
    if len(matches) < 8:
        return None
    a: Array = np.asarray(xy_a[matches[:, 0]], np.float64)
    b: Array = np.asarray(xy_b[matches[:, 1]], np.float64)
    try:
        found, mask = cv2.findHomography(a, b, cv2.USAC_MAGSAC, within_px, maxIters=3000, confidence=0.9999)
    except cv2.error:
        return None
    H: Array = np.zeros((3, 3)) if found is None else np.asarray(found, np.float64)
    if not plausible(H, camera):
        return None
    inliers = matches[mask.ravel().astype(bool)]
    return Verified(H, inliers, _overlapping(H, a, b, camera))


def _overlapping(H: Array, a: Array, b: Array, camera: Camera) -> int:
    forth, back = transfer(H, a), transfer(np.asarray(np.linalg.inv(H)), b)
    size = np.array([camera.width_px, camera.height_px])
    inside = ((forth > 0) & (forth < size)).all(axis=1) & ((back > 0) & (back < size)).all(axis=1)
    return int(inside.sum())


def plausible(H: Array, camera: Camera) -> bool:
    """Not mirrored, nothing behind the horizon, no scale change beyond 4 and no shear beyond 60°."""
    w, h = camera.width_px - 1.0, camera.height_px - 1.0
    corners = np.array([[0, 0], [w, 0], [w, h], [0, h], [w / 2, h / 2]])
    depth = corners @ H[2, :2] + H[2, 2]
    if not np.isfinite(H).all() or (np.sign(depth) != np.sign(depth[4])).any() or depth[4] == 0:
        return False
    q = transfer(H, corners)
    edges = np.roll(q[:4], -1, axis=0) - q[:4]
    turns = edges[:, 0] * np.roll(edges, -1, axis=0)[:, 1] - edges[:, 1] * np.roll(edges, -1, axis=0)[:, 0]
    sides = np.linalg.norm(edges, axis=1)
    lengths = sides / np.array([w, h, w, h])
    sines = turns / (sides * np.roll(sides, -1) + 1e-12)
    return bool((sines > 0.5).all() and lengths.min() > 0.25 and lengths.max() < 4.0)


def transfer(H: Array, points: Array) -> Array:
    """(N, 2) points through a homography."""
    q = points @ H[:, :2].T + H[:, 2]
    return np.asarray(q[:, :2] / q[:, 2:])
