"""LZF decompression (Marc Lehmann's liblzf), the packing of PCD's binary_compressed."""

import numba
import numpy as np
import numpy.typing as npt

from tasks.registration.readers.file_scan import Unreadable

Bytes = npt.NDArray[np.uint8]


def decompress(packed: Bytes, size: int) -> Bytes:
    """(size,) bytes. Raises Unreadable where the block is damaged."""
    if size > 300 * max(len(packed), 1):  # LZF packs at most 264 bytes into 3
        raise Unreadable("its compressed block is damaged")
    unpacked = np.zeros(size, np.uint8)
    if _unpack(packed, unpacked) != size:
        raise Unreadable("its compressed block is damaged")
    return unpacked


@numba.njit(cache=True)
def _unpack(packed: Bytes, unpacked: Bytes) -> int:
    """Number of bytes written, or −1 where a length or a reference leaves its buffer."""
    read = 0
    written = 0
    while read < packed.size:
        control = int(packed[read])
        read += 1
        if control < 32:  # that many literals and one
            length = control + 1
            if read + length > packed.size or written + length > unpacked.size:
                return -1
            for k in range(length):
                unpacked[written + k] = packed[read + k]
            read += length
        else:  # a reference back: length in the top three bits, offset in thirteen
            length = control >> 5
            if length == 7:
                if read >= packed.size:
                    return -1
                length += int(packed[read])
                read += 1
            length += 2
            if read >= packed.size:
                return -1
            source = written - ((control & 31) << 8) - int(packed[read]) - 1
            read += 1
            if source < 0 or written + length > unpacked.size:
                return -1
            for k in range(length):  # byte by byte: the reference may overlap what it writes
                unpacked[written + k] = unpacked[source + k]
        written += length
    return written
