"""RootSIFT features, spread over the photo (Lowe 2004; Arandjelović & Zisserman 2012)."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt

from schemas.camera import Camera

DETECTION_PX = 1.0e6  # photos are shrunk to this many pixels first: bounds the cost; SIFT doubles them again
CONTRAST = 0.002  # OpenCV's 0.04 finds next to nothing on fair-faced concrete; the strongest are taken
CELLS = (8, 6)  # across and down: each gets its share of the features
UNIT = 512.0  # RootSIFT has unit length; times this it fits 8 bits


@dataclass(frozen=True)
class Keypoints:
    xy: npt.NDArray[np.float32]  # (N, 2) undistorted photo pixels
    scale: npt.NDArray[np.float32]  # (N,) photo pixels
    angle: npt.NDArray[np.float32]  # (N,) degrees
    response: npt.NDArray[np.float32]  # (N,) contrast as OpenCV has it, 0..1: tells texture from noise
    descriptors: npt.NDArray[np.uint8]  # (N, 128)


def detect_features(grey: npt.NDArray[np.uint8], camera: Camera, most: int) -> Keypoints:
    """At most `most` features of a photo; detected on it as it is, then undistorted as points."""
    height, width = grey.shape
    shrink = min(1.0, (DETECTION_PX / (width * height)) ** 0.5)
    small = (
        grey
        if shrink == 1.0
        else cv2.resize(grey, (round(width * shrink), round(height * shrink)), interpolation=cv2.INTER_AREA)
    )
    sift = cv2.SIFT.create(contrastThreshold=CONTRAST, enable_precise_upscale=True)
    chosen = _spread(sift.detect(small, None), small.shape[1], small.shape[0], most)
    found, descriptors = sift.compute(small, chosen)
    if not found:
        empty = np.zeros(0, np.float32)
        return Keypoints(np.zeros((0, 2), np.float32), empty, empty, empty, np.zeros((0, 128), np.uint8))
    step = np.array([width / small.shape[1], height / small.shape[0]])
    pixels = (np.array([k.pt for k in found]) + 0.5) * step - 0.5
    if not camera.is_ideal:
        ideal = camera.undistort((pixels - camera.principal_px) / camera.focal_px)
        pixels = ideal * camera.focal_px + camera.principal_px
    lit = np.isfinite(pixels).all(axis=1)  # a fisheye's corners may show no ray
    return Keypoints(
        xy=pixels[lit].astype(np.float32),
        scale=(np.array([k.size for k in found])[lit] * step.mean()).astype(np.float32),
        angle=np.array([k.angle for k in found], np.float32)[lit],
        response=np.array([k.response for k in found], np.float32)[lit],
        descriptors=_root(np.asarray(descriptors, np.float32)[lit]),
    )


def _spread(found: Sequence[cv2.KeyPoint], width: int, height: int, most: int) -> list[cv2.KeyPoint]:
    """The strongest of each cell before the second strongest of any."""
    x, y = np.array([k.pt for k in found]).reshape(-1, 2).T
    response = np.array([k.response for k in found])
    column = np.clip(x * CELLS[0] / width, 0, CELLS[0] - 1).astype(np.int64)
    cell = column + CELLS[0] * np.clip(y * CELLS[1] / height, 0, CELLS[1] - 1).astype(np.int64)
    by_cell = np.lexsort((y, x, -response, cell))
    first_of_cell = np.searchsorted(cell[by_cell], cell[by_cell])
    rank = np.empty(len(found), int)
    rank[by_cell] = np.arange(len(found)) - first_of_cell
    return [found[i] for i in np.lexsort((y, x, -response, rank))[:most]]


def _root(descriptors: npt.NDArray[np.float32]) -> npt.NDArray[np.uint8]:
    share = descriptors / np.maximum(descriptors.sum(axis=1, keepdims=True), 1e-9)
    return np.asarray(np.minimum(np.rint(np.sqrt(share) * UNIT), 255), dtype=np.uint8)


def write_features(keypoints: Keypoints, path: Path) -> None:
    """NPZ; the same features give the same bytes."""
    np.savez(
        path,
        xy=keypoints.xy,
        scale=keypoints.scale,
        angle=keypoints.angle,
        response=keypoints.response,
        descriptors=keypoints.descriptors,
    )
