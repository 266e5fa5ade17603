"""What every reader hands on, block by block: the numbers of one scan as they stand in its file.

A reader's `read(path, index)` yields a scan in blocks of at most BLOCK points, so that no scan is ever whole
in memory; each block says the pose and viewpoint of its scan again.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]


BLOCK = 1 << 20  # points


class Unreadable(Exception):
    """A file that is not what its name says, is cut short, or holds what no scan can be."""

    def __init__(self, what: str, remedy: str = "Export the scan again, or leave the file out.") -> None:
        super().__init__(what)
        self.remedy = remedy


@dataclass(frozen=True)
class FileScan:
    """A block of it. Lengths in the file's own unit; rows may still be NaN."""

    points: Array  # (N, 3) float64
    normals: Array | None = None  # (N, 3)
    T_world_scan: Array | None = None  # (4, 4), where the file states a pose
    viewpoint: Array | None = None  # (3,) scanner in the points' frame; None: not stated


def rigid_pose(matrix: Array) -> Array | None:
    """The (4, 4) pose of a file, or None for the identity that formats write when they know no pose.

    Raises Unreadable for a matrix that scales, shears or mirrors.
    """
    rotation = matrix[:3, :3]
    if not np.isfinite(matrix).all() or np.abs(rotation @ rotation.T - np.eye(3)).max() > 1e-3:
        raise Unreadable("its pose scales or shears the scan, so it is no position of a scanner")
    if np.linalg.det(rotation) < 0:
        raise Unreadable("its pose mirrors the scan, so it is no position of a scanner")
    if np.abs(matrix - np.eye(4)).max() < 1e-9:
        return None
    left, _, right = np.linalg.svd(rotation)  # files print few digits: make it a rotation again
    pose = np.eye(4)
    pose[:3, :3] = left @ right
    pose[:3, 3] = matrix[:3, 3]
    return pose
