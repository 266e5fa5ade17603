"""A photo as an ideal lens would have shown it, in its own pixels."""

import cv2
import numpy as np
import numpy.typing as npt

from schemas.camera import Camera
from tasks.stitching.compositing import Pixels, Tile

Map = npt.NDArray[np.float32]


def undistorted_tile(pixels: Pixels, camera: Camera) -> Tile:
    """The whole photo as one tile; the very pixels where the lens has no distortion."""
    height, width = pixels.shape[:2]
    covered = np.full((height, width), 255, np.uint8)
    if not camera.is_ideal:
        x, y = _maps(camera)
        straight = cv2.remap(pixels, x, y, cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE)
        pixels = np.asarray(straight, np.uint8)
        covered[(x < 0) | (y < 0) | (x > width - 1) | (y > height - 1)] = 0
        pixels[covered == 0] = 0
    return Tile(0, 0, pixels, covered, (covered > 0).astype(np.uint16))


def _maps(camera: Camera) -> tuple[Map, Map]:
    """Where each pixel of the ideal photo lies in the photo as taken."""
    size, K = (camera.width_px, camera.height_px), camera.K
    if camera.lens == "fisheye":
        D = np.array([camera.k1, camera.k2, camera.k3, camera.k4])
        x, y = cv2.fisheye.initUndistortRectifyMap(K, D, np.eye(3), K, size, cv2.CV_32FC1)
    else:
        D = np.array([camera.k1, camera.k2, camera.p1, camera.p2, camera.k3])
        x, y = cv2.initUndistortRectifyMap(K, D, None, K, size, cv2.CV_32FC1)
    return np.asarray(x, np.float32), np.asarray(y, np.float32)
