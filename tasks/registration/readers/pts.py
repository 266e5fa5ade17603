"""PTS (Leica): a count, then as many rows `x y z [intensity [r g b]]`; several such blocks are one cloud."""

import itertools
from pathlib import Path

import numpy as np

from tasks.registration.readers.file_scan import FileScan, Unreadable
from tasks.registration.readers.text_rows import plain, read_rows


def count(path: Path) -> int:
    return 1


def read(path: Path, index: int) -> FileScan:
    """Coordinates are those of the project, not of a scanner."""
    blocks = []
    with path.open(encoding="utf-8") as text:
        lines = (line for line in map(plain, text) if line.strip())
        first = next(lines, "")
        if len(first.split()) >= 3:  # some programs leave the count out
            blocks.append(read_rows(itertools.chain([first], lines), (0, 1, 2)))
            first = ""
        while first:
            if not first.strip().isdecimal():
                raise Unreadable(f"more rows follow than it announces, the first is {first.strip()[:40]!r}")
            blocks.append(read_rows(lines, (0, 1, 2), int(first)))
            first = next(lines, "")
    return FileScan(np.concatenate(blocks) if blocks else np.empty((0, 3)))
