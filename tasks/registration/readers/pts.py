"""PTS (Leica): a count, then as many rows `x y z [intensity [r g b]]`; several such blocks are one cloud."""

import itertools
from collections.abc import Iterator
from pathlib import Path

from tasks.registration.readers.file_scan import FileScan, Unreadable
from tasks.registration.readers.text_rows import plain, row_blocks


def count(path: Path) -> int:
    return 1


def read(path: Path, index: int) -> Iterator[FileScan]:
    """Coordinates are those of the project, not of a scanner."""
    with path.open(encoding="utf-8-sig") as text:
        lines = (line for line in map(plain, text) if line.strip())
        first = next(lines, "")
        if len(first.split()) >= 3:  # some programs leave the count out
            yield from map(FileScan, row_blocks(itertools.chain([first], lines), (0, 1, 2)))
            first = ""
        while first:
            if not first.strip().isdecimal():
                raise Unreadable(f"more rows follow than it announces, the first is {first.strip()[:40]!r}")
            yield from map(FileScan, row_blocks(lines, (0, 1, 2), int(first)))
            first = next(lines, "")
