"""Pairs of stations that overlap, each tied by fine alignment."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from schemas.settings import RegistrationSettings
from tasks.registration.icp import align
from tasks.registration.overlap import overlap, overlapping
from tasks.registration.placement import LEAST_STABILITY
from tasks.registration.pose_graph import Edge
from tasks.registration.rigid_motion import Array, inverse, transform
from tasks.registration.station_cloud import balanced_sample
from tasks.registration.station_site import Shape, Site

SPACINGS = 2.0  # τ is at least so many of the target's own: a sparse cloud has no point nearer
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


def aligned(
    shapes: Sequence[Shape], source: int, target: int, T_start: Array, settings: RegistrationSettings
) -> Edge | None:
    """The fine alignment of two stations, or None where it does not hold near the coarse one."""
    voxel_m = shapes[source].voxel_m
    sample = balanced_sample(shapes[source].middle, FINE_POINTS, settings.seed)
    found = align(sample, shapes[target].middle, T_start, (voxel_m, voxel_m / 2))
    if found is None:
        return None
    T = found.T_target_source
    moved_m = transform(T, sample.points_m) - transform(T_start, sample.points_m)
    if np.linalg.norm(moved_m, axis=1).mean() > 4 * voxel_m:
        return None
    return Edge(source, target, T, found.information, found.inliers, found.rmse_m)


def ties(sites: Sequence[Site], edges: Sequence[Edge], settings: RegistrationSettings) -> list[Tie]:
    """The edges whose stations overlap by τ as much as is asked; each fine cloud is taken once. Where a cloud
    is sparser than τ, its own spacing takes τ's place."""
    near: dict[tuple[int, int], float] = {}  # share of the first station's points near one of the second
    for station, site in enumerate(sites):
        touching = [e for e in edges if station in (e.source, e.target)]
        if not touching:
            continue
        cloud = site.fine.cloud()
        tau_m = max(settings.tau_m, SPACINGS * cloud.spacing_m)
        for edge in touching:
            other, T = edge.source, edge.T_target_source
            if station == edge.source:
                other, T = edge.target, inverse(T)
            share = overlapping(sites[other].sample_m, cloud, T, tau_m).mean()
            near[other, station] = float(share)
    found = []
    for edge in edges:
        share, back = near[edge.source, edge.target], near[edge.target, edge.source]
        if max(share, back) >= settings.min_overlap:
            found.append(Tie(edge, share))
    return found
