"""E57 (ASTM E2807): several scans a file, each with its pose. Lengths are metres by the standard."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pye57

from schemas.utm import zone_in
from tasks.registration.readers.file_scan import BLOCK, FileScan, Unreadable, rigid_pose

FIELDS = {
    "cartesian": ("cartesianX", "cartesianY", "cartesianZ"),
    "spherical": ("sphericalRange", "sphericalAzimuth", "sphericalElevation"),
}


def count(path: Path) -> int:
    with _opened(path) as e57:
        return int(e57.scan_count)


def read(path: Path, index: int) -> Iterator[FileScan]:
    """Points that the file marks as invalid are dropped. Spherical coordinates become Cartesian."""
    with _opened(path) as e57:
        if index >= e57.scan_count:
            raise Unreadable(f"it has no scan number {index + 1}")
        header = e57.get_header(index)
        if header.point_count == 0:
            return
        pose = None
        if header.has_pose():
            matrix = np.eye(4)
            matrix[:3, :3] = header.rotation_matrix
            matrix[:3, 3] = header.translation
            pose = rigid_pose(matrix)
        kind = next((kind for kind in FIELDS if set(FIELDS[kind]) <= set(header.point_fields)), None)
        if kind is None:
            raise Unreadable("its points have neither Cartesian nor spherical coordinates")
        invalid = f"{kind}InvalidState"
        fields = [*FIELDS[kind], *([invalid] if invalid in header.point_fields else [])]
        data, buffers = e57.make_buffers(fields, min(BLOCK, header.point_count))
        reader = header.points.reader(buffers)
        while read := reader.read():
            first, second, third = (data[name][:read].astype(np.float64) for name in FIELDS[kind])
            points = np.column_stack([first, second, third])
            if kind == "spherical":
                points = first[:, None] * np.column_stack(
                    [np.cos(third) * np.cos(second), np.cos(third) * np.sin(second), np.sin(third)]
                )
            if invalid in data:
                points = points[data[invalid][:read] == 0]
            yield FileScan(points, None, pose, np.zeros(3))


def stated_utm_zone(path: Path) -> str | None:
    """Of the coordinate system that the file states as WKT; None where that is no UTM."""
    with _opened(path) as e57:
        root = e57.root
        return (
            zone_in(str(root["coordinateMetadata"].value())) if root.isDefined("coordinateMetadata") else None
        )


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
