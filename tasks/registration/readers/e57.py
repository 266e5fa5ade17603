"""E57 (ASTM E2807): several scans a file, each with its pose. Lengths are metres by the standard."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pye57

from tasks.registration.readers.file_scan import FileScan, Unreadable, rigid_pose


def count(path: Path) -> int:
    with _opened(path) as e57:
        return int(e57.scan_count)


def read(path: Path, index: int) -> FileScan:
    """Points that the file marks as invalid are dropped. Spherical coordinates become Cartesian."""
    with _opened(path) as e57:
        if index >= e57.scan_count:
            raise Unreadable(f"it has no scan number {index + 1}")
        header = e57.get_header(index)
        if header.point_count == 0:
            return FileScan(np.empty((0, 3)))
        data = e57.read_scan(index, transform=False, ignore_missing_fields=True)
        if "cartesianX" in data:
            points = np.column_stack([data[f"cartesian{axis}"] for axis in "XYZ"])
        else:
            distance, azimuth, elevation = (
                data[f"spherical{part}"] for part in ("Range", "Azimuth", "Elevation")
            )
            points = distance[:, None] * np.column_stack(
                [
                    np.cos(elevation) * np.cos(azimuth),
                    np.cos(elevation) * np.sin(azimuth),
                    np.sin(elevation),
                ]
            )
        pose = None
        if header.has_pose():
            matrix = np.eye(4)
            matrix[:3, :3] = header.rotation_matrix
            matrix[:3, 3] = header.translation
            pose = rigid_pose(matrix)
    return FileScan(points.astype(np.float64), None, pose, np.zeros(3))


@contextmanager
def _opened(path: Path) -> Iterator[pye57.E57]:
    try:
        e57 = pye57.E57(str(path))
        try:
            yield e57
        finally:
            e57.close()
    except pye57.libe57.E57Exception as error:
        raise Unreadable(f"libE57 refuses it: {str(error).strip().splitlines()[0]}") from error
