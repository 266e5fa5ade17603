"""Reading the occupied points of a structure."""

from pathlib import Path

import numpy as np
import numpy.typing as npt
import open3d as o3d

from schemas.problem import BadInput

Array = npt.NDArray[np.float64]


def read_points(path: Path) -> Array:
    """(N, 3) float64 metres of a PLY cloud, without points that are not finite."""
    with o3d.utility.VerbosityContextManager(o3d.utility.VerbosityLevel.Error):
        points = np.asarray(o3d.io.read_point_cloud(path, format="ply").points)
    points = points[np.isfinite(points).all(axis=1)]
    if not len(points):
        raise BadInput("occupied points", "the cloud is empty or unreadable", "Extract the surfaces again.")
    return np.asarray(points, dtype=np.float64)
