"""PLY: ascii and binary, any scalar types, x y z and, where there, nx ny nz of the element `vertex`."""

import itertools
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

import numpy as np

from tasks.registration.readers.file_scan import BLOCK, Array, FileScan, Unreadable
from tasks.registration.readers.text_rows import row_blocks

TYPES = {
    **dict.fromkeys(("char", "int8"), "i1"),
    **dict.fromkeys(("uchar", "uint8"), "u1"),
    **dict.fromkeys(("short", "int16"), "i2"),
    **dict.fromkeys(("ushort", "uint16"), "u2"),
    **dict.fromkeys(("int", "int32"), "i4"),
    **dict.fromkeys(("uint", "uint32"), "u4"),
    **dict.fromkeys(("float", "float32"), "f4"),
    **dict.fromkeys(("double", "float64"), "f8"),
}
LONGEST_HEADER = 1 << 16  # bytes; a file without an end of header is not read to its end


@dataclass
class Element:
    name: str
    count: int
    properties: list[tuple[str, str]]  # name, numpy type without byte order; "list" for lists


def count(path: Path) -> int:
    return 1


def read(path: Path, index: int) -> Iterator[FileScan]:
    with path.open("rb") as stream:
        encoding, elements = _header(stream)
        at = next((i for i, e in enumerate(elements) if e.name == "vertex"), None)
        if at is None:
            raise Unreadable("it is a PLY file without points (no element vertex)")
        vertex = elements[at]
        names = [name for name, kind in vertex.properties if kind != "list"]
        if not {"x", "y", "z"} <= set(names):
            raise Unreadable("its points have no properties x, y, z")
        wanted = ["x", "y", "z", *(["nx", "ny", "nz"] if {"nx", "ny", "nz"} <= set(names) else [])]
        lists = any(kind == "list" for element in elements[: at + 1] for _, kind in element.properties)
        if lists and encoding != "ascii":
            raise Unreadable("its points are mixed with lists, which are passed over in ASCII files only")
        if encoding == "ascii":
            text = (line.decode("ascii") for line in stream)
            for _ in itertools.islice(text, sum(element.count for element in elements[:at])):
                pass
            if lists:
                text = (_without_lists(line.split(), vertex) for line in text)
            for rows in row_blocks(text, [names.index(name) for name in wanted], vertex.count):
                yield _block(rows)
        else:
            order = "<" if encoding == "binary_little_endian" else ">"
            for element in elements[:at]:
                stream.seek(_dtype(element, order).itemsize * element.count, 1)
            dtype = _dtype(vertex, order)
            there = (path.stat().st_size - stream.tell()) // dtype.itemsize
            if there < vertex.count:
                raise Unreadable(
                    f"it is cut short: {vertex.count} points are announced and {max(there, 0)} follow"
                )
            for done in range(0, vertex.count, BLOCK):
                table = np.fromfile(stream, dtype, min(BLOCK, vertex.count - done))
                yield _block(np.column_stack([table[name].astype(np.float64) for name in wanted]))


def _without_lists(words: list[str], element: Element) -> str:
    """A row's scalars; each list is its length, then so many numbers."""
    kept, at = [], 0
    try:
        for _, kind in element.properties:
            if kind == "list":
                at += 1 + int(words[at])
            else:
                kept.append(words[at])
                at += 1
    except (IndexError, ValueError):
        raise Unreadable(f"the lists of its points do not fit the row {' '.join(words)[:40]!r}") from None
    return " ".join(kept)


def _block(rows: Array) -> FileScan:
    return FileScan(rows[:, :3], rows[:, 3:] if rows.shape[1] == 6 else None)


def _header(stream: BinaryIO) -> tuple[str, list[Element]]:
    if stream.readline(16).strip() != b"ply":
        raise Unreadable("it is no PLY file (its first line is not `ply`)")
    encoding = ""
    elements: list[Element] = []
    while True:
        line = stream.readline(1024)
        if not line or stream.tell() > LONGEST_HEADER:
            raise Unreadable("its PLY header has no end")
        words = line.decode("ascii", errors="replace").split()
        match words:
            case ["end_header"]:
                break
            case ["format", ("ascii" | "binary_little_endian" | "binary_big_endian") as kind, _]:
                encoding = kind
            case ["element", name, number] if number.isdecimal():
                elements.append(Element(name, int(number), []))
            case ["property", "list", _, _, name] if elements:
                elements[-1].properties.append((name, "list"))
            case ["property", kind, name] if elements and kind in TYPES:
                elements[-1].properties.append((name, TYPES[kind]))
            case [] | ["comment" | "obj_info", *_]:
                pass
            case _:
                raise Unreadable(f"its PLY header has the unknown line {' '.join(words)[:60]!r}")
    if not encoding:
        raise Unreadable("its PLY header states no format")
    return encoding, elements


def _dtype(element: Element, order: str) -> np.dtype[np.void]:
    return np.dtype([(name, order + kind) for name, kind in element.properties])
