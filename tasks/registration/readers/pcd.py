"""PCD (Point Cloud Library) 0.7: ascii, binary and binary_compressed."""

from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

import numpy as np
import numpy.typing as npt

from tasks.registration.readers.file_scan import BLOCK, FileScan, Unreadable
from tasks.registration.readers.lzf import decompress
from tasks.registration.readers.text_rows import row_blocks

Array = npt.NDArray[np.float64]
KEYS = {"VERSION", "FIELDS", "SIZE", "TYPE", "COUNT", "WIDTH", "HEIGHT", "VIEWPOINT", "POINTS", "DATA"}
NORMALS = ("normal_x", "normal_y", "normal_z")


def count(path: Path) -> int:
    return 1


def read(path: Path, index: int) -> Iterator[FileScan]:
    """A compressed file is unpacked whole, as its packing wants; the others are read block by block."""
    with path.open("rb") as stream:
        header = _header(stream)
        fields = [name.lower() for name in header["FIELDS"]]
        counts = [int(number) for number in header.get("COUNT", ["1"] * len(fields))]
        kinds = [k.lower() + s for k, s in zip(header["TYPE"], header["SIZE"], strict=True)]
        points = int(header["POINTS"][0])
        if not {"x", "y", "z"} <= set(fields):
            raise Unreadable("its points have no fields x, y, z")
        wanted = ["x", "y", "z", *(NORMALS if set(NORMALS) <= set(fields) else [])]
        dtypes = [np.dtype(f"<{kind}") for kind in kinds]
        sizes = [dtype.itemsize * number for dtype, number in zip(dtypes, counts, strict=True)]
        encoding = header["DATA"][0]
        viewpoint = np.array(header.get("VIEWPOINT", ["0"] * 7), dtype=float)[:3]
        blocks: Iterator[Array]
        if encoding == "ascii":
            starts = np.cumsum([0, *counts])
            text = (line.decode("ascii") for line in stream)
            blocks = row_blocks(text, [int(starts[fields.index(name)]) for name in wanted], points)
        elif encoding == "binary":
            _check_length(stream, points * sum(sizes), path)
            starts = np.cumsum([0, *sizes])
            tables = (
                np.frombuffer(stream.read(n * sum(sizes)), np.uint8).reshape(n, sum(sizes))
                for n in _block_sizes(points)
            )
            blocks = (
                _columns(
                    [table[:, s : s + d.itemsize] for s, d in zip(starts, dtypes, strict=False)],
                    dtypes, fields, wanted,
                )
                for table in tables
            )  # fmt: skip
        elif encoding == "binary_compressed":
            packed, unpacked = (int(n) for n in _exactly(stream, 8, path).view("<u4"))
            if unpacked != points * sum(sizes):
                raise Unreadable("its compressed block does not hold the points that its header announces")
            data = decompress(_exactly(stream, packed, path), unpacked)
            starts = np.cumsum([0, *(size * points for size in sizes)])
            raw = [
                data[s : s + size * points].reshape(points, size)[:, : d.itemsize]
                for s, size, d in zip(starts, sizes, dtypes, strict=False)
            ]
            blocks = (
                _columns([field[done : done + BLOCK] for field in raw], dtypes, fields, wanted)
                for done in range(0, points, BLOCK)
            )
        else:
            raise Unreadable(f"its DATA is {encoding!r}, not ascii, binary or binary_compressed")
        for rows in blocks:
            yield FileScan(rows[:, :3], rows[:, 3:] if len(wanted) == 6 else None, None, viewpoint)


def _header(stream: BinaryIO) -> dict[str, list[str]]:
    header: dict[str, list[str]] = {}
    while "DATA" not in header:
        words = stream.readline(4096).decode("ascii", errors="replace").split()
        if words and words[0].startswith("#"):
            continue
        if not words or words[0] not in KEYS:
            raise Unreadable("it has no PCD header")
        header[words[0]] = words[1:]
    missing = [key for key in ("FIELDS", "SIZE", "TYPE", "POINTS") if not header.get(key)]
    if missing:
        raise Unreadable(f"its PCD header lacks {', '.join(missing)}")
    if len({len(header[key]) for key in ("FIELDS", "SIZE", "TYPE", "COUNT") if key in header}) > 1:
        raise Unreadable("its PCD header gives fields, sizes, types and counts in different numbers")
    return header


def _block_sizes(points: int) -> Iterator[int]:
    return (min(BLOCK, points - done) for done in range(0, points, BLOCK))


def _exactly(stream: BinaryIO, size: int, path: Path) -> npt.NDArray[np.uint8]:
    _check_length(stream, size, path)
    return np.frombuffer(stream.read(size), np.uint8)


def _check_length(stream: BinaryIO, size: int, path: Path) -> None:
    there = path.stat().st_size - stream.tell()
    if not 0 <= size <= there:
        raise Unreadable(f"it is cut short: {size} bytes of points are announced and {there} follow")


def _columns(
    raw: list[npt.NDArray[np.uint8]], dtypes: list[np.dtype[np.generic]], fields: list[str], wanted: list[str]
) -> Array:
    """(N, len(wanted)) float64 of the raw bytes (N, itemsize) of each field."""
    at = [fields.index(name) for name in wanted]
    return np.column_stack(
        [np.ascontiguousarray(raw[i]).view(dtypes[i])[:, 0].astype(np.float64) for i in at]
    )
