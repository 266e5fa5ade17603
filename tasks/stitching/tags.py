"""Printed tags (ArUco, AprilTag) in photos: marks that nobody has to click."""

import cv2
import numpy as np
import numpy.typing as npt

from schemas.control import TagFamily
from tasks.stitching.view import Array

REFINED_PX = 5  # half a side of the window in which a corner is refined


def find_tags(rgb: npt.NDArray[np.uint8], family: TagFamily) -> dict[str, Array]:
    """Centre (2,) in pixels, by id; a tag that is there twice is not told apart, and left out.

    The centre is where the diagonals cross: perspective keeps it, unlike the mean of the corners."""
    parameters = cv2.aruco.DetectorParameters()
    parameters.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_SUBPIX
    parameters.cornerRefinementWinSize = REFINED_PX
    dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, f"DICT_{family}"))
    grey = cv2.cvtColor(rgb, cv2.COLOR_RGB2GRAY)
    corners, ids, _ = cv2.aruco.ArucoDetector(dictionary, parameters).detectMarkers(grey)
    names = [] if ids is None else [str(int(i)) for i in np.ravel(ids)]
    return {
        name: _crossing(np.asarray(four, np.float64).reshape(4, 2))
        for name, four in zip(names, corners, strict=True)
        if names.count(name) == 1
    }


def _crossing(corners: Array) -> Array:
    a, b, c, d = np.column_stack([corners, np.ones(4)])
    x, y, w = np.cross(np.cross(a, c), np.cross(b, d))
    return np.array([x / w, y / w])
