"""XYZ, TXT, ASC and CSV: a row a point, with or without a header row that names its columns."""

import codecs
import itertools
import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from tasks.registration.readers.file_scan import Array, FileScan, Unreadable
from tasks.registration.readers.text_rows import is_number, plain, row_blocks

LOOKED_AT = 65_536  # bytes that tell the encoding
LONGEST_ROWS = 4096  # bytes at the end that hold the last two rows
LEAST_TO_COUNT = 10  # rows whose first number is one more than the last's: no scanner measures so
DECIMAL_COMMA = re.compile(r"[+-]?\d*(,\d+)?([eE][+-]?\d+)?")
SURVEYED = {"easting": "x", "northing": "y", "elevation": "z", "height": "z"}


def count(path: Path) -> int:
    return 1


def read(path: Path, index: int) -> Iterator[FileScan]:
    """A header row must name x, y, z and may name nx, ny, nz (as `x`, `//X`, `"X [m]"`, `Easting`); without
    one, the first three columns are x, y, z. Separators: blanks, commas, semicolons; where commas do not
    separate, they are decimal. A number alone before all rows says how many follow. A last row that is cut
    short is passed over."""
    with path.open(encoding=_encoding(path)) as lines:
        head: list[str] = []
        first = _first_row(lines, head)
        announced = int(first) if first.strip().isdecimal() else 0
        if announced:
            first = _first_row(lines, head)
        named = [_names(line) for line in head if {"x", "y", "z"} <= set(_names(line))]
        decimal_comma = _decimal_comma(first)
        tokens = plain(first, decimal_comma=decimal_comma).split()
        if all(map(is_number, tokens)):
            columns = _columns(named[-1]) if named else [0, 1, 2]
        else:
            named = [_names(first)]
            columns = _columns(named[-1])
            first = _first_row(lines, head)
            decimal_comma = _decimal_comma(first)
        if len(tokens) < 3:
            raise Unreadable("its rows have fewer than the three columns x, y, z")
        rest: Iterator[str] = itertools.chain([first], lines)
        if is_cut_short(path):
            rest = (line for line, _ in itertools.pairwise(rest))
        following = (plain(line, decimal_comma=decimal_comma) for line in rest)
        found = 0
        for rows in row_blocks(following, columns):
            if not (found or named) and len(tokens) > 3 and _counts(rows[:, 0]):
                raise Unreadable(
                    "its first column counts the rows, and no header names the columns",
                    "Take that column out, or write a first row that names them all, such as id,x,y,z.",
                )
            found += len(rows)
            yield FileScan(rows[:, :3], rows[:, 3:] if rows.shape[1] == 6 else None)
    if found < announced:
        raise Unreadable(f"it is cut short: {announced} points are announced and {found or 'none'} follow")


def is_cut_short(path: Path) -> bool:
    """Whether its last row has no end and fewer numbers than the row before: its writing or copying broke
    off."""
    with path.open("rb") as stream:
        stream.seek(max(0, path.stat().st_size - LONGEST_ROWS))
        *_, before, last = ["", *stream.read().decode("latin-1").split("\n")]
    return 0 < len(plain(last).split()) < len(plain(before).split())


def _counts(column: Array) -> bool:
    return len(column) >= LEAST_TO_COUNT and bool((np.diff(column) == 1).all())


def _encoding(path: Path) -> str:
    """UTF-8, with or without its mark; Latin-1 where some heading's umlaut is not UTF-8."""
    with path.open("rb") as stream:
        start = stream.read(LOOKED_AT)
    try:
        codecs.getincrementaldecoder("utf-8")().decode(start)
    except UnicodeDecodeError:
        return "latin-1" if re.search(rb"[0-9A-Za-z]", start) else "utf-8"
    return "utf-8-sig"


def _first_row(lines: Iterator[str], head: list[str]) -> str:
    """The next line that is no comment; blank lines and comments are added to `head`."""
    for line in lines:
        if line.strip() and not _is_comment(line):
            return line
        head.append(line)
    raise Unreadable("it holds no points")


def _decimal_comma(row: str) -> bool:
    """Whether the commas of a row of points are decimal: something else separates."""
    tokens = row.replace(";", " ").split()
    if ";" in row and not all(map(is_number, tokens)):
        return True
    return len(tokens) >= 3 and "," in row and all(map(DECIMAL_COMMA.fullmatch, tokens))


def _is_comment(line: str) -> bool:
    return line.lstrip().startswith(("#", "//"))


def _names(line: str) -> list[str]:
    """Column names of a header row, lower case, without units and quotes; x, y, z for a surveyor's."""
    bare = re.sub(r"\[[^]]*\]|\([^)]*\)|[#/\"']", "", line)
    names = [name.strip().lower() for name in re.split(r"[,;\s]+", bare.strip())]
    return [SURVEYED.get(name, name) if SURVEYED.get(name) not in names else name for name in names]


def _columns(names: list[str]) -> list[int]:
    if not {"x", "y", "z"} <= set(names):
        raise Unreadable("its first row is neither numbers nor a header that names the columns x, y, z")
    wanted = ["x", "y", "z"]
    if {"nx", "ny", "nz"} <= set(names):
        wanted += ["nx", "ny", "nz"]
    return [names.index(name) for name in wanted]
