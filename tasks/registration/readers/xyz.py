"""XYZ, TXT, ASC and CSV: a row a point, with or without a header row that names its columns."""

import itertools
import re
from collections.abc import Iterator
from pathlib import Path

from tasks.registration.readers.file_scan import FileScan, Unreadable
from tasks.registration.readers.text_rows import is_number, plain, row_blocks


def count(path: Path) -> int:
    return 1


def read(path: Path, index: int) -> Iterator[FileScan]:
    """A header row must name x, y, z and may name nx, ny, nz (as `x`, `//X`, `"X [m]"`); without one, the
    first three columns are x, y, z. Separators: blanks, commas, semicolons (then commas are decimal)."""
    with path.open(encoding="utf-8", errors="strict") as lines:
        head: list[str] = []
        first = ""
        for line in lines:
            first = line
            if line.strip() and not _is_comment(line):
                break
            head.append(line)
        else:
            raise Unreadable("it holds no points")
        decimal_comma = ";" in first and not all(map(is_number, first.replace(";", " ").split()))
        tokens = plain(first, decimal_comma=decimal_comma).split()
        if all(map(is_number, tokens)):
            named = [_names(line) for line in head if {"x", "y", "z"} <= set(_names(line))]
            columns = _columns(named[-1]) if named else [0, 1, 2]
            following: Iterator[str] = itertools.chain([first], lines)
        else:
            columns = _columns(_names(first))
            following = lines
            decimal_comma = ";" in first
        if len(tokens) < 3:
            raise Unreadable("its rows have fewer than the three columns x, y, z")
        for rows in row_blocks((plain(line, decimal_comma=decimal_comma) for line in following), columns):
            yield FileScan(rows[:, :3], rows[:, 3:] if rows.shape[1] == 6 else None)


def _is_comment(line: str) -> bool:
    return line.lstrip().startswith(("#", "//"))


def _names(line: str) -> list[str]:
    """Column names of a header row, lower case, without units and quotes."""
    bare = re.sub(r"\[[^]]*\]|\([^)]*\)|[#/\"']", "", line)
    return [name.strip().lower() for name in re.split(r"[,;\s]+", bare.strip())]


def _columns(names: list[str]) -> list[int]:
    if not {"x", "y", "z"} <= set(names):
        raise Unreadable("its first row is neither numbers nor a header that names the columns x, y, z")
    wanted = ["x", "y", "z"]
    if {"nx", "ny", "nz"} <= set(names):
        wanted += ["nx", "ny", "nz"]
    return [names.index(name) for name in wanted]
