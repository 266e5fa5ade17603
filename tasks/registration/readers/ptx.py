"""PTX (Leica): scans one after another, each a grid of columns × rows with the scanner's pose.

A scan's head: columns, rows, scanner position, three scanner axes, and the 4×4 transform to the world, whose
rows are written for row vectors (the transpose of ours). Pixels without a return are written `0 0 0`.
"""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import numpy.typing as npt

from tasks.registration.readers.file_scan import FileScan, Unreadable, rigid_pose
from tasks.registration.readers.text_rows import plain, read_rows, row_blocks

Array = npt.NDArray[np.float64]


def count(path: Path) -> int:
    scans = 0
    with path.open(encoding="utf-8") as text:
        lines = _lines(text)
        while (points := _grid(lines)) is not None:
            _transform(lines)
            if sum(1 for _ in zip(range(points), lines, strict=False)) < points:
                raise Unreadable(f"it is cut short: scan {scans + 1} announces {points} points")
            scans += 1
    return scans


def read(path: Path, index: int) -> Iterator[FileScan]:
    with path.open(encoding="utf-8") as text:
        lines = _lines(text)
        at = 0
        while (points := _grid(lines)) is not None:
            transform = _transform(lines)
            if at < index:
                for _ in zip(range(points), lines, strict=False):
                    pass
                at += 1
                continue
            pose = rigid_pose(transform)
            for rows in row_blocks(lines, (0, 1, 2), points):
                yield FileScan(rows[(rows != 0).any(axis=1)], None, pose, np.zeros(3))
            return
    raise Unreadable(f"it has no scan number {index + 1}")


def _lines(text: Iterator[str]) -> Iterator[str]:
    return (line for line in map(plain, text) if line.strip())


def _grid(lines: Iterator[str]) -> int | None:
    """Number of points of the next scan; None at the end of the file."""
    columns = next(lines, None)
    if columns is None:
        return None
    rows = next(lines, "")
    if not (columns.strip().isdecimal() and rows.strip().isdecimal()):
        raise Unreadable("where a PTX scan gives its columns and rows it says something else")
    return int(columns) * int(rows)


def _transform(lines: Iterator[str]) -> Array:
    for _ in range(4):  # position and axes: the transform says the same
        next(lines, None)
    rows = read_rows(lines, (0, 1, 2, 3), 4)
    return np.asarray(rows.T)
