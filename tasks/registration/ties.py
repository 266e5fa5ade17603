"""Pairs of stations that overlap, each tied by fine alignment."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
import numpy.typing as npt

from schemas.settings import RegistrationSettings
from tasks.registration.icp import align
from tasks.registration.overlap import overlap, overlapping
from tasks.registration.placement import LEAST_STABILITY
from tasks.registration.pose_graph import Edge
from tasks.registration.rigid_motion import Array, inverse, transform
from tasks.registration.station_cloud import Cloud, balanced_sample
from tasks.registration.station_site import Shape, Site

OVERLAP_POINTS = 20_000
FINE_POINTS = 30_000  # of a source in fine alignment: 3 mm noise averages out to hundredths


@dataclass(frozen=True)
class Tie:
    edge: Edge
    overlap: float  # share of the source's points, by the paper's τ


def candidate_pairs(
    T_frame_local: dict[int, Array], shapes: Sequence[Shape], voxel_m: float, min_overlap: float
) -> Iterator[tuple[int, int, Array]]:
    """(source, target, T_target_source) of stations whose coarse clouds overlap as they were placed."""
    for source, target in combinations(sorted(T_frame_local), 2):
        T = inverse(T_frame_local[target]) @ T_frame_local[source]
        found = overlap(shapes[source].cloud, shapes[target].cloud, T, voxel_m)
        back = overlap(shapes[target].cloud, shapes[source].cloud, inverse(T), voxel_m)
        if (
            max(found.share, back.share) >= min_overlap
            and min(found.stability, back.stability) >= LEAST_STABILITY
        ):
            yield source, target, T


def tie(
    sites: Sequence[Site],
    shapes: Sequence[Shape],
    source: int,
    target: int,
    T_start: Array,
    settings: RegistrationSettings,
) -> Tie | None:
    """The tie of two stations, or None where they do not overlap by the paper's τ as much as is asked."""
    voxel_m = shapes[source].voxel_m
    sample = balanced_sample(shapes[source].middle, FINE_POINTS, settings.seed)
    found = align(sample, shapes[target].middle, T_start, (voxel_m, voxel_m / 2))
    if found is None:
        return None
    T = found.T_target_source
    moved_m = transform(T, sample.points_m) - transform(T_start, sample.points_m)
    if np.linalg.norm(moved_m, axis=1).mean() > 4 * voxel_m:
        return None
    one, other = sites[source].fine.cloud(), sites[target].fine.cloud()
    near = overlapping(_some(one), other, T, settings.tau_m).mean()
    back = overlapping(_some(other), one, inverse(T), settings.tau_m).mean()
    if max(near, back) < settings.min_overlap:
        return None
    return Tie(Edge(source, target, T, found.information, found.inliers, found.rmse_m), float(near))


def _some(cloud: Cloud) -> npt.NDArray[np.float32]:
    """Evenly chosen points, enough to tell a share of them to half a percent."""
    return cloud.points_m[:: max(1, len(cloud) // OVERLAP_POINTS)]
