"""A photo as an ideal lens would have shown it, in its own pixels."""

import cv2
import numpy as np

from schemas.camera import Camera
from tasks.stitching.compositing import Pixels, Tile


def undistorted_tile(pixels: Pixels, camera: Camera) -> Tile:
    """The whole photo as one tile; the very pixels where the lens has no distortion."""
    height, width = pixels.shape[:2]
    covered = np.full((height, width), 255, np.uint8)
    if any(camera.distortion):
        size, K = (width, height), camera.K
        x, y = cv2.initUndistortRectifyMap(K, np.array(camera.distortion), None, K, size, cv2.CV_32FC1)
        straight = cv2.remap(pixels, x, y, cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE)
        pixels = np.asarray(straight, np.uint8)
        covered[(x < 0) | (y < 0) | (x > width - 1) | (y > height - 1)] = 0
        pixels[covered == 0] = 0
    return Tile(0, 0, pixels, covered, (covered > 0).astype(np.uint16))
