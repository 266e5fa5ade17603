"""One scan of a file of any known format, checked, in metres, block by block."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType

import numpy as np
import numpy.typing as npt

from schemas.problem import BadInput
from tasks.registration.readers import e57, las, pcd, ply, pts, ptx, xyz
from tasks.registration.readers.file_scan import FileScan, Unreadable

Array = npt.NDArray[np.float64]

READERS: dict[str, ModuleType] = {
    ".ply": ply, ".pcd": pcd, ".xyz": xyz, ".txt": xyz, ".asc": xyz, ".csv": xyz, ".pts": pts, ".ptx": ptx,
    ".e57": e57, ".las": las, ".laz": las,
}  # fmt: skip
SMALLEST_M, LARGEST_M = 0.2, 10_000.0  # extent of what a terrestrial scanner sees of a structure
FARTHEST_M = 1e8  # no coordinate system on Earth goes so far
LARGE_COORDINATE_M = 1000.0  # beyond it float32 is coarser than 0.06 mm: shift to a local origin
UNITS_M = {"km": 1000.0, "m": 1.0, "ft": 0.3048, "in": 0.0254, "cm": 0.01, "mm": 0.001}
USUAL_M = (1.0, 2000.0)  # extent of what is inspected, for naming the units that a scan may be in


SAMPLED = 10_000  # points of a block by which the extent is judged


@dataclass(frozen=True)
class LoadedScan:
    """A scan, or a block of one, in metres. Its file's coordinates are `points_m + origin_m`."""

    points_m: Array  # (N, 3) float64, finite
    normals: Array | None  # (N, 3) unit, as the file has them; zeros where it has none
    T_world_scan: Array | None  # (4, 4), maps points_m to the file's world, where the file states a pose
    viewpoint_m: Array | None  # (3,) scanner in the frame of points_m; None: the file does not say
    origin_m: Array  # (3,) taken off large coordinates (UTM); zeros for others


def scan_count(path: Path, name: str | None = None) -> int:
    """How many scans the file holds, at least one. BadInput where it cannot be read."""
    name = name or path.name
    with _BadInputOf(name):
        scans = int(_reader(path, name).count(path))
    if scans == 0:
        raise BadInput(name, "it holds no scan", "Export the scan again and check that it has points.")
    return scans


def stated_unit_m(path: Path, name: str | None = None) -> float | None:
    """Metres per unit where the file itself says so (coordinate system of LAS and LAZ)."""
    if path.suffix.lower() not in (".las", ".laz"):
        return None
    with _BadInputOf(name or path.name):
        return las.stated_unit_m(path)


def stated_utm_zone(path: Path, name: str | None = None) -> str | None:
    """Such as 32N, where the file itself says so (coordinate system of LAS, LAZ and E57)."""
    with _BadInputOf(name or path.name):
        if path.suffix.lower() in (".las", ".laz"):
            return las.stated_utm_zone(path)
        return e57.stated_utm_zone(path) if path.suffix.lower() == ".e57" else None


def cut_short(path: Path) -> bool:
    """Whether its last row is a torso, which `scan_blocks` passes over: some of the file is lost."""
    return _reader(path, path.name) is xyz and xyz.is_cut_short(path)


def scan_blocks(
    path: Path, index: int = 0, unit_m: float = 1.0, name: str | None = None
) -> Iterator[LoadedScan]:
    """Scan number `index` (from 0) in blocks of at most a million points; none is empty.

    Points that are NaN, infinite, off the Earth, or repeatedly (0, 0, 0), as programs write shots without
    an echo, are dropped. Coordinates beyond 1 km (UTM) lose a rounded origin, the same in all blocks, so that
    float32 keeps them exact later on. Raises BadInput under `name` for a file that cannot be read, is cut
    short, holds no usable point, or, after the last block, whose extent no structure has: 40 km or 40 mm say
    that the unit is not the stated one.
    """
    name = name or path.name
    origin_m: Array | None = None
    samples: list[Array] = []
    empty = True
    with _BadInputOf(name):
        for scan in _reader(path, name).read(path, index):
            empty = empty and len(scan.points) == 0
            with np.errstate(all="ignore"):  # damaged bytes make odd floats
                usable = np.asarray((np.abs(scan.points) < FARTHEST_M / unit_m).all(axis=1))  # NaN is not
            at_zero = ~scan.points.any(axis=1)
            if at_zero.sum() > 1:  # a point may lie there; many are shots without an echo
                usable &= ~at_zero
            if not usable.any():
                continue
            points_m = scan.points[usable] * unit_m
            if origin_m is None:
                middle_m = np.median(points_m, axis=0)
                origin_m = np.where(np.abs(middle_m) > LARGE_COORDINATE_M, np.round(middle_m, -2), 0.0)
            samples.append(points_m[:: max(1, len(scan.points) // SAMPLED)])
            yield LoadedScan(
                points_m - origin_m,
                _unit_normals(scan.normals, usable),
                _pose_of_shifted(scan, unit_m, origin_m),
                _viewpoint(scan, unit_m, origin_m),
                origin_m,
            )
    if empty:
        raise BadInput(name, "it holds no points", "Export the scan again and check that it has points.")
    if not samples:
        raise BadInput(name, "all of its points are NaN or (0, 0, 0)", "Export the scan again.")
    _check_extent(np.concatenate(samples), unit_m, name)


def read_scan(path: Path, index: int = 0, unit_m: float = 1.0, name: str | None = None) -> LoadedScan:
    """All blocks of a scan as one, for clouds that fit into memory."""
    blocks = list(scan_blocks(path, index, unit_m, name))
    normals = [b.normals for b in blocks if b.normals is not None]
    return LoadedScan(
        np.concatenate([b.points_m for b in blocks]),
        np.concatenate(normals) if len(normals) == len(blocks) else None,
        blocks[0].T_world_scan,
        blocks[0].viewpoint_m,
        blocks[0].origin_m,
    )


def _pose_of_shifted(scan: FileScan, unit_m: float, origin_m: Array) -> Array | None:
    if scan.T_world_scan is None:
        return None
    T_world_scan = scan.T_world_scan.copy()
    T_world_scan[:3, 3] = T_world_scan[:3, 3] * unit_m + T_world_scan[:3, :3] @ origin_m
    return T_world_scan


def _viewpoint(scan: FileScan, unit_m: float, origin_m: Array) -> Array | None:
    if scan.viewpoint is None or not scan.viewpoint.any():  # zeros are what formats write when they know none
        return None
    return np.asarray(scan.viewpoint * unit_m - origin_m)


def _reader(path: Path, name: str) -> ModuleType:
    reader = READERS.get(path.suffix.lower())
    if reader is None:
        raise BadInput(
            name, f"scans of kind {path.suffix or '(no suffix)'!r} are not known",
            f"Use one of {', '.join(sorted(READERS))}.",
        )  # fmt: skip
    return reader


class _BadInputOf:
    """Turns whatever a reader or its library raises about damaged bytes into one BadInput."""

    def __init__(self, name: str) -> None:
        self.name = name

    def __enter__(self) -> None:
        pass

    def __exit__(self, kind: object, error: BaseException | None, _: object) -> None:
        if isinstance(error, Exception) and not isinstance(error, BadInput):
            told = (
                error if isinstance(error, Unreadable) else Unreadable(f"its bytes make no sense ({error})")
            )
            if isinstance(error, UnicodeDecodeError):
                told = Unreadable("it is no text file, though its name says so")
            raise BadInput(self.name, str(told), told.remedy) from error


def _check_extent(points_m: Array, unit_m: float, name: str) -> None:
    low_m, high_m = np.percentile(points_m, [1, 99], axis=0) if len(points_m) >= 1000 else (
        points_m.min(axis=0), points_m.max(axis=0),
    )  # fmt: skip
    extent_m = float(np.linalg.norm(high_m - low_m))
    if extent_m == 0.0 or SMALLEST_M <= extent_m <= LARGEST_M:
        return
    sizes_m = {unit: metres * extent_m / unit_m for unit, metres in UNITS_M.items()}
    low_m, high_m = USUAL_M
    usual = [f"{unit}: {_in_words(size_m)}" for unit, size_m in sizes_m.items() if low_m <= size_m <= high_m]
    state = f"State its unit, --unit or unit:, by the size that it has ({', '.join(usual)})"
    by_hand = "; from km, convert it to metres first" if low_m <= sizes_m["km"] <= high_m else ""
    raise BadInput(
        name,
        f"taken in units of {unit_m:g} m it is {_in_words(extent_m)} large, which no scanned structure is",
        f"{state}{by_hand}." if usual else "Check its unit and its coordinates.",
    )


def _in_words(size_m: float) -> str:
    if size_m < 1.0:
        return f"{size_m * 1000:.3g} mm"
    return f"{size_m:.3g} m" if size_m < 1000.0 else f"{size_m / 1000:.3g} km"


def _unit_normals(normals: Array | None, finite: npt.NDArray[np.bool_]) -> Array | None:
    """None for columns of zeros, as some programs write them."""
    if normals is None:
        return None
    kept = normals[finite]
    length = np.linalg.norm(kept, axis=1, keepdims=True)
    usable = np.isfinite(length) & (length > 1e-6)
    if usable.mean() < 0.99:
        return None
    return np.asarray(np.where(usable, kept / np.where(usable, length, 1.0), 0.0))
