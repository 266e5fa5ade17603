"""Masks as grey PNG of any size, written and read row by row: other libraries hold all of it, and OpenCV
reads no more than 2^30 pixels (PNG specification, third edition)."""

import struct
import zlib
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

from schemas.bit_mask import BitMask
from schemas.problem import BadInput

SIGNATURE = b"\x89PNG\r\n\x1a\n"
HEADER = ">IIBBBBB"  # width, height, bits, colour type, compression, filter, interlace
EIGHT_BIT_GREY = (8, 0, 0, 0, 0)  # not one bit: some programs read that as 0 and 1
WHITE = np.uint8(255)
LEVEL = 1  # of zlib: masks are mostly empty


def write_mask(mask: BitMask, path: Path) -> None:
    """255 where the mask is set, 0 elsewhere."""
    packer = zlib.compressobj(LEVEL)
    with path.open("wb") as file:
        file.write(SIGNATURE)
        header = struct.pack(HEADER, mask.width_px, mask.height_px, *EIGHT_BIT_GREY)
        file.write(_chunk(b"IHDR", header))
        for _, band in mask.bands():
            unfiltered = np.pad(WHITE * band, ((0, 0), (1, 0)))  # each row begins with its filter: 0, none
            if packed := packer.compress(unfiltered.tobytes()):
                file.write(_chunk(b"IDAT", packed))
        file.write(_chunk(b"IDAT", packer.flush()))
        file.write(_chunk(b"IEND", b""))


def read_mask(path: Path, name: str) -> BitMask:
    """What write_mask wrote. Raises BadInput by name for anything else."""
    try:
        with path.open("rb") as file:
            if file.read(len(SIGNATURE)) != SIGNATURE:
                raise ValueError("no PNG")
            chunks = _chunks(file.read)
            width, height, *kind = struct.unpack(HEADER, next(chunks)[1])
            if tuple(kind) != EIGHT_BIT_GREY:
                raise ValueError("not of 8-bit grey")
            mask = BitMask(height, width)
            _fill(mask, (data for name_, data in chunks if name_ == b"IDAT"))
            return mask
    except (OSError, ValueError, StopIteration, struct.error, zlib.error) as problem:
        raise BadInput(name, f"its mask cannot be read ({problem})", "Detect its cracks again") from None


def _chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def _chunks(read: Callable[[int], bytes]) -> Iterator[tuple[bytes, bytes]]:
    """Kind and data of each, up to the end that every PNG has."""
    kind = b""
    while kind != b"IEND":
        (size,), kind = struct.unpack(">I", read(4)), read(4)
        data = read(size)
        if struct.unpack(">I", read(4))[0] != zlib.crc32(kind + data):
            raise ValueError("damaged")
        yield kind, data


def _fill(mask: BitMask, packed: Iterator[bytes]) -> None:
    unpacker, row_bytes = zlib.decompressobj(), 1 + mask.width_px
    waiting, top = b"", 0
    for data in packed:
        waiting += unpacker.decompress(data)
        count = len(waiting) // row_bytes
        rows = np.frombuffer(waiting, dtype=np.uint8, count=count * row_bytes).reshape(count, row_bytes)
        if rows[:, 0].any():
            raise ValueError("another program wrote it")
        mask.write(top, 0, rows[:, 1:] > 0)
        waiting, top = waiting[count * row_bytes :], top + count
    if top != mask.height_px or waiting:
        raise ValueError("cut short")
