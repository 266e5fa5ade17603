"""A station as registration sees it: its clouds, what its scanner saw, and what the crew knew of its pose."""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from schemas.problem import BadInput
from schemas.scan import Scan
from tasks.registration import visibility
from tasks.registration.cloud_shelf import Shelf, Shelved
from tasks.registration.feature_match import Features, shape_features
from tasks.registration.read_scan import LoadedScan
from tasks.registration.rigid_motion import Array, inverse, pose, transform
from tasks.registration.standpoint import standpoint
from tasks.registration.station_cloud import (
    Cloud,
    away_from,
    balanced_sample,
    coarse_cloud,
    coarse_voxel_m,
    fine_cloud,
    on_surfaces,
    turned,
)

# Of normals that a program turned to (0, 0, 0); where no scanner stood there, they tell no side.
MOST_AWAY = 0.1
LEAST_POINTS = 100  # fewer, at equal density, are no scan of a structure
FEATURE_RADII = 5  # coarse voxels
SAMPLE_POINTS = 3000  # likewise to a percent
OVERLAP_POINTS = 20_000  # tell a share of them to half a percent


@dataclass(frozen=True)
class Site:
    """Frames: `scan` is the file's (metres), `local` the file's minus `shift_m` (kept small)."""

    name: str
    fine: Shelved  # local frame
    sample_m: npt.NDArray[np.float32]  # (N, 3) local, evenly chosen from the fine cloud
    coarse_voxel_m: float  # at which its shape has about the right number of points
    scanner_m: Array | None  # (3,) local
    shift_m: Array  # (3,) local + shift = scan
    prior_T_world_local: Array | None  # as stated by the crew or the file; to be verified
    position_m: Array | None  # (3,) measured scanner position in the world
    points: int
    targets_m: dict[str, Array]  # (3,) local, by name


@dataclass(frozen=True)
class Shape:
    """A site at coarse resolution."""

    cloud: Cloud
    voxel_m: float
    middle: Cloud  # at a quarter of the coarse voxel, what fine alignment works on
    image: visibility.RangeImage | None

    @cached_property
    def features(self) -> Features:
        """Only stations without a usable position need them."""
        return shape_features(self.cloud, FEATURE_RADII * self.voxel_m)

    @cached_property
    def sample(self) -> Cloud:
        """Of all facings alike; only where no scanner's place is known is it needed."""
        return balanced_sample(self.middle, SAMPLE_POINTS, 0)


def site(scan: Scan, blocks: Iterable[LoadedScan], voxel_m: float, shelf: Shelf) -> Site:
    """The station of a scan that arrives in blocks, its cloud on the shelf. Raises BadInput where nothing can
    be registered by so few points."""
    fine, loaded, points = fine_cloud(blocks, voxel_m)
    if len(fine) < LEAST_POINTS:
        raise BadInput(
            scan.name,
            f"{len(fine)} points at {voxel_m * 1000:g} mm spacing are too few to register",
            "Scan again, or leave the file out.",
        )
    prior, scanner_m, position_m = _standing(scan, loaded, fine.points_m.astype(np.float64))
    if loaded.normals is None or (scanner_m is None and away_from(-loaded.origin_m, fine).mean() < MOST_AWAY):
        fine = turned(fine, scanner_m)
    coarse_m = coarse_voxel_m(fine, scanner_m)
    if (near := len(on_surfaces(fine, coarse_m))) < LEAST_POINTS:
        raise BadInput(
            scan.name,
            f"too few points to show a surface: {near} of {len(fine)} have another within {coarse_m:.1f} m",
            "Scan more densely, or leave the file out.",
        )
    return Site(
        name=scan.name,
        fine=shelf.put(fine),
        sample_m=fine.points_m[:: max(1, len(fine) // OVERLAP_POINTS)].copy(),
        coarse_voxel_m=coarse_m,
        scanner_m=scanner_m,
        shift_m=loaded.origin_m,
        prior_T_world_local=prior,
        position_m=position_m,
        points=points,
        targets_m={t.name: np.array(t.position) * scan.unit_m - loaded.origin_m for t in scan.targets},
    )


def _standing(
    scan: Scan, loaded: LoadedScan, points_m: Array
) -> tuple[Array | None, Array | None, Array | None]:
    """`prior_T_world_local`, `scanner_m` and `position_m` of a site. What is stated of the scanner counts
    where it can have seen the points from there."""
    prior = loaded.T_world_scan
    if scan.T_world_scan is not None:  # the crew's word goes before the file's
        prior = np.array(scan.T_world_scan) @ pose(np.eye(3), loaded.origin_m)
    position_m = None if scan.station_position_m is None else np.array(scan.station_position_m)
    as_in_world = pose(np.eye(3), loaded.origin_m) if prior is None else prior
    measured = [] if position_m is None else [transform(inverse(as_in_world), position_m[None])[0]]
    of_file = [] if loaded.viewpoint_m is None else [loaded.viewpoint_m]
    scanner_m = standpoint(points_m, [*measured, *of_file])
    if not loaded.origin_m.any() and (
        standpoint(points_m, [np.zeros(3)]) is not None or (measured and scanner_m is None)
    ):  # the scanner's own frame
        scanner_m = of_file[0] if of_file else np.zeros(3)
    elif prior is None:  # coordinates of a map or a site are the world's
        prior = as_in_world
    if position_m is None and prior is not None and scanner_m is not None:
        position_m = transform(prior, scanner_m[None])[0]
    return prior, scanner_m, position_m


def shape(site: Site, voxel_m: float) -> Shape:
    """Lone echoes have no say on where a station may stand; fine alignment sees to its outliers itself."""
    fine = site.fine.cloud()
    solid = on_surfaces(fine, voxel_m)
    return Shape(
        coarse_cloud(solid, voxel_m),
        voxel_m,
        coarse_cloud(fine, voxel_m / 4),
        visibility.range_image(solid, site.scanner_m),
    )
