"""The registered cloud in memory, and the PLY files at both ends of this stage."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

from schemas.problem import BadInput
from schemas.surface import Surface

Floats = npt.NDArray[np.float64]
Indices = npt.NDArray[np.int64]
Mask = npt.NDArray[np.bool_]

_PLY_TYPES = {
    "char": "i1", "int8": "i1", "uchar": "u1", "uint8": "u1",
    "short": "<i2", "int16": "<i2", "ushort": "<u2", "uint16": "<u2",
    "int": "<i4", "int32": "<i4", "uint": "<u4", "uint32": "<u4",
    "float": "<f4", "float32": "<f4", "double": "<f8", "float64": "<f8",
}  # fmt: skip
LARGEST_M = 10_000.0  # no structure is this long; in a wrong unit it is
BULK = (1, 99)  # percent of the points, between which the structure lies,
FEWEST = 1000  # where there are so many
MOST_AWAY = 0.1  # of a station's normals; a grazing view turns a few
CHUNK = 4_000_000  # points of a table looked at together
ALONG = 0.7  # cosine: a normal within 45° of a surface's own
_NORMAL_NEIGHBOURS = 16  # of a point, when the file has no normals


@dataclass(frozen=True)
class Cloud:
    """points: (N, 3) metres. normals: (N, 3) unit, of either sign: a grazing view leaves it open.
    views: (N, 3) unit, from each point towards the scanner that saw it. sides_known: false where the
    scanners' places are not known and normals had to stand for views."""

    points: Floats
    normals: Floats
    views: Floats
    sides_known: bool = True

    def __len__(self) -> int:
        return len(self.points)

    def __getitem__(self, chosen: Mask | Indices) -> "Cloud":
        return Cloud(self.points[chosen], self.normals[chosen], self.views[chosen], self.sides_known)


def read_cloud(path: Path, item: str, scanners_m: Floats) -> Cloud:
    """The cloud of a binary PLY with x y z, and nx ny nz and station where it has them.

    scanners_m: (S, 3) the stations' scanners in the cloud's frame, at least one; NaN where it is not known.
    A point belongs to the nearest where the file does not say. Points come out in an order that depends on
    their coordinates alone, so that results do too.

    A few points far off are left out. Raises BadInput, naming `item`, for a file that is no such PLY, is cut
    short, has no finite point or whose bulk extends over more than LARGEST_M.
    """
    table = read_table(path, item)
    points = np.column_stack([table[axis] for axis in "xyz"]).astype(np.float64)
    order = np.lexsort((points[:, 2], points[:, 1], points[:, 0]))
    order = order[np.isfinite(points[order]).all(axis=1)]
    if not len(order):
        raise BadInput(
            item, "the cloud has no point with finite coordinates", "Check the scans it was made of"
        )
    table, points = table[order], points[order]
    shares = BULK if len(points) >= FEWEST else (0, 100)
    extent_m = float(np.ptp(np.percentile(points, shares, axis=0), axis=0).max())
    if extent_m > LARGEST_M:
        raise BadInput(
            item,
            f"the cloud extends over {extent_m / 1000:.0f} km",
            "State the unit of the scans (`unit: mm`?) or remove the stray points",
        )
    near = (np.abs(points - np.median(points, axis=0)) < LARGEST_M).all(axis=1)  # without lone echoes far off
    table, points = table[near], points[near]

    names = table.dtype.names or ()
    if {"nx", "ny", "nz"} <= set(names):
        normals = np.column_stack([table[axis] for axis in ("nx", "ny", "nz")]).astype(np.float64)
    else:
        normals = _estimate_normals(points, scanners_m)
    normals = unit(np.nan_to_num(normals, posinf=0.0, neginf=0.0))

    if "station" in names and int(table["station"].max()) < len(scanners_m):
        owner = table["station"].astype(np.int64)
    else:
        owner = _nearest(points, scanners_m)
    views, sides_known = _views(points, normals, owner, scanners_m)
    return Cloud(points, normals, views, sides_known)


def _views(points: Floats, normals: Floats, owner: Indices, scanners_m: Floats) -> tuple[Floats, bool]:
    """Directions to the points' scanners, and whether all are known. Registration turns normals to the
    scanner; where many turn away from it, no scanner stood there (the cloud was merged, mobile or aerial):
    normals tell the side, as they do where the scanner is not known."""
    views = unit(scanners_m[owner] - points)
    away = np.einsum("ni,ni->n", normals, views) < 0
    owned = np.bincount(owner, minlength=len(scanners_m))
    doubted = np.bincount(owner, away, len(scanners_m)) > MOST_AWAY * owned
    doubted |= np.isnan(scanners_m).any(axis=1)
    return np.where(doubted[owner, None], normals, views), not doubted.any()


def write_points(path: Path, points_m: Floats) -> None:
    """A binary PLY of float32 x y z."""
    header = (
        f"ply\nformat binary_little_endian 1.0\nelement vertex {len(points_m)}\n"
        "property float x\nproperty float y\nproperty float z\nend_header\n"
    )
    path.write_bytes(header.encode() + points_m.astype("<f4").tobytes())


def unit(vectors: Floats) -> Floats:
    """(N, 3) vectors at length 1; a zero vector stays zero."""
    return np.asarray(vectors / np.maximum(np.linalg.norm(vectors, axis=1, keepdims=True), 1e-12))


def on_surface(table: npt.NDArray[np.void], surface: Surface) -> Floats:
    """(N, 3) places, in the surface's frame, of the points whose normals are along its own, where it and
    what lies beside it may be; a chunk of the cloud at a time."""
    u0, v0, u1, v1 = surface.bounds_m
    middle, reach = np.array([(u0 + u1) / 2, (v0 + v1) / 2]), np.hypot(u1 - u0, v1 - v0)
    normal, found = np.asarray(surface.plane.normal), [np.zeros((0, 3))]
    for start in range(0, len(table), CHUNK):
        part = table[start : start + CHUNK]
        uvw = surface.to_surface(np.column_stack([part[axis] for axis in "xyz"]))
        near = (np.abs(uvw[:, :2] - middle).max(axis=1) < reach) & (np.abs(uvw[:, 2]) < 1.0)
        if {"nx", "ny", "nz"} <= set(table.dtype.names or ()):
            normals = np.column_stack([part[axis][near] for axis in ("nx", "ny", "nz")])
            near[near] = np.abs(normals @ normal) > ALONG
        found.append(uvw[near])
    return np.concatenate(found)


def read_table(path: Path, item: str) -> npt.NDArray[np.void]:
    """The points of a binary PLY as they lie in the file, read where they are looked at. Raises BadInput."""
    remedy = "Make it again with `hairline register`, which writes binary little-endian PLY"
    with path.open("rb") as stream:
        lines: list[str] = []
        while not lines or lines[-1] != "end_header":
            line = stream.readline(1000)
            lines.append(line.decode("ascii", "replace").strip())
            if not line or lines[0] != "ply" or len(lines) > 200:
                raise BadInput(item, "the cloud is no PLY file", remedy)
        if "format binary_little_endian 1.0" not in lines:
            raise BadInput(item, "the PLY is not binary little-endian", remedy)
        fields: list[tuple[str, str]] = []
        count, in_vertex = 0, False
        for words in (line.split() for line in lines):
            if words[:1] == ["element"]:
                in_vertex = words[1] == "vertex"
                if in_vertex and not words[2].isdecimal():
                    raise BadInput(item, "the PLY's header is damaged", remedy)
                count = int(words[2]) if in_vertex else count
                if not in_vertex and not fields:
                    raise BadInput(item, "the PLY does not begin with its points", remedy)
            elif words[:1] == ["property"] and in_vertex:
                if words[1] not in _PLY_TYPES:
                    raise BadInput(item, f"the PLY's points have a property of type {words[1]}", remedy)
                fields.append((words[2], _PLY_TYPES[words[1]]))
        if not {"x", "y", "z"} <= {name for name, _ in fields}:
            raise BadInput(item, "the PLY's points have no x, y, z", remedy)
        start, point = stream.tell(), np.dtype(fields)
    there = (path.stat().st_size - start) // point.itemsize
    if there < count:
        raise BadInput(item, f"the PLY is cut short: {there} of {count} points", remedy)
    return np.memmap(path, point, "r", start, (count,)) if count else np.zeros(0, point)


def _nearest(points: Floats, scanners_m: Floats) -> Indices:
    """(N,) which of the known scanners is nearest to each point; the first where none is known."""
    known = np.flatnonzero(~np.isnan(scanners_m).any(axis=1))
    if not len(known):
        return np.zeros(len(points), dtype=np.int64)
    return np.asarray(known[cKDTree(scanners_m[known]).query(points)[1]])


def _estimate_normals(points: Floats, scanners_m: Floats) -> Floats:
    """Direction of least spread of each point's nearest neighbours, towards the nearest known scanner."""
    normals = np.zeros_like(points)
    if len(points) < 3:
        return normals
    tree = cKDTree(points)
    for start in range(0, len(points), 100_000):
        part = slice(start, start + 100_000)
        near = tree.query(points[part], k=min(_NORMAL_NEIGHBOURS, len(points)))[1]
        spread = points[near] - points[near].mean(axis=1, keepdims=True)
        covariance = np.einsum("nki,nkj->nij", spread, spread)
        normals[part] = np.linalg.eigh(covariance)[1][:, :, 0]
    scanner_m = scanners_m[_nearest(points, scanners_m)]
    normals[np.einsum("ni,ni->n", normals, scanner_m - points) < 0] *= -1
    return normals
