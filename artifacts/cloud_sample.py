"""Some points of a registered cloud, evenly picked, for a picture of it."""

from pathlib import Path

import numpy as np
import numpy.typing as npt

from schemas.problem import BadInput

MOST_POINTS = 250_000
TYPES = {
    "char": "i1", "uchar": "u1", "short": "<i2", "ushort": "<u2", "int": "<i4", "uint": "<u4",
    "float": "<f4", "double": "<f8", "int8": "i1", "uint8": "u1", "int16": "<i2", "uint16": "<u2",
    "int32": "<i4", "uint32": "<u4", "float32": "<f4", "float64": "<f8",
}  # fmt: skip


def cloud_sample(path: Path) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.intp]]:
    """(N, 3) positions in metres and (N,) station indices, N ≤ 250,000, of a binary little-endian PLY as
    registration writes it. Reads only what it picks, through a memory map."""
    fields: list[tuple[str, str]] = []
    count = 0
    with path.open("rb") as stream:
        for line in stream:
            words = line.decode("latin-1").split()
            if words[:2] == ["element", "vertex"]:
                count = int(words[2])
            elif words[:1] == ["property"] and words[1] in TYPES:
                fields.append((words[2], TYPES[words[1]]))
            elif words == ["end_header"]:
                break
        start = stream.tell()
    names = [name for name, _ in fields]
    if count == 0 or not {"x", "y", "z"} <= set(names):
        raise BadInput(
            "registered model", "its cloud cannot be read for a picture", "Register the scans again"
        )
    table = np.memmap(path, dtype=np.dtype(fields), mode="r", offset=start, shape=(count,))
    picked = table[:: max(1, -(-count // MOST_POINTS))]
    points = np.column_stack([np.asarray(picked[axis], dtype=float) for axis in "xyz"])
    stations = (
        picked["station"].astype(np.intp) if "station" in names else np.zeros(len(picked), dtype=np.intp)
    )
    return points, stations
