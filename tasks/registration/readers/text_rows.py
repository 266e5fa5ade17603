"""Rows of numbers in text files."""

import itertools
from collections.abc import Iterator, Sequence

import numpy as np
import numpy.typing as npt

from tasks.registration.readers.file_scan import BLOCK, Unreadable

Array = npt.NDArray[np.float64]


def plain(line: str, *, decimal_comma: bool = False) -> str:
    """The line with blanks as its only separator. Where semicolons separate, commas may be decimal."""
    if decimal_comma:
        return line.replace(",", ".").replace(";", " ")
    return line.replace(",", " ").replace(";", " ")


def is_number(token: str) -> bool:
    try:
        float(token)
    except ValueError:
        return False
    return True


def row_blocks(lines: Iterator[str], columns: Sequence[int], count: int | None = None) -> Iterator[Array]:
    """Blocks of `read_rows`, at most BLOCK rows each; no empty one."""
    done = 0
    while count is None or done < count:
        asked = BLOCK if count is None else min(count - done, BLOCK)
        rows = read_rows(itertools.islice(lines, asked), columns)
        done += len(rows)
        if len(rows):
            yield rows
        if len(rows) < asked:
            break
    if count is not None and done < count:
        raise Unreadable(f"it is cut short: {count} points are announced and {done or 'none'} follow")


def read_rows(lines: Iterator[str], columns: Sequence[int], count: int | None = None) -> Array:
    """(N, len(columns)) float64 of blank-separated lines; exactly `count` of them where it is given.

    Raises Unreadable where a row is not numeric, too short, or missing.
    """
    if count == 0:
        return np.empty((0, len(columns)))
    wanted = lines if count is None else itertools.islice(lines, count)
    first = next(wanted, None)
    if first is None:
        if count is None:
            return np.empty((0, len(columns)))
        raise Unreadable(f"it is cut short: {count} points are announced and none follow")
    try:
        rows = np.loadtxt(
            itertools.chain([first], wanted), usecols=tuple(columns), ndmin=2, comments=None, dtype=np.float64
        )
    except ValueError as error:
        raise Unreadable(f"a row of its points is not numeric ({error})") from error
    if count is not None and len(rows) < count:
        raise Unreadable(f"it is cut short: {count} points are announced and {len(rows)} follow")
    return rows
