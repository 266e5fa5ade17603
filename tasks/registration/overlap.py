"""Overlap of two scans, and whether what overlaps can hold them together."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from tasks.registration.rigid_motion import Array, transform
from tasks.registration.station_cloud import Cloud

AGREEING_NORMALS = np.cos(np.radians(40))


@dataclass(frozen=True)
class Overlap:
    share: float  # of the source's points
    stability: float  # least share of the normals' energy along any direction; 0: all one plane


def overlapping(
    source_m: npt.NDArray[np.floating], target: Cloud, T_target_source: Array, tau_m: float
) -> npt.NDArray[np.bool_]:
    """(N,) whether each source point has a target point closer than τ (paper, eq. 1).

    The paper prints ‖(x_i^a − a) − (x_j^b − b)‖ < τ with a, b the scanner positions. Read literally, with
    both clouds already in one frame, that subtracts two different offsets from the same physical point. Here
    a and b do what they must: both scans are first brought into one frame (`T_target_source`), and points
    closer than τ there overlap.
    """
    distance_m, _ = target.nearest(transform(T_target_source, source_m), tau_m)
    return np.asarray(np.isfinite(distance_m))


def overlap(source: Cloud, target: Cloud, T_target_source: Array, tau_m: float) -> Overlap:
    """Overlap by the paper's τ where the surfaces also face the same way."""
    distance_m, nearest = target.nearest(transform(T_target_source, source.points_m), tau_m)
    near = np.flatnonzero(np.isfinite(distance_m))
    if len(near) == 0:
        return Overlap(0.0, 0.0)
    normals = source.normals[near] @ T_target_source[:3, :3].T
    same = np.einsum("ij,ij->i", normals, target.normals[nearest[near]]) > AGREEING_NORMALS
    kept = normals[same]
    if len(kept) < 10:
        return Overlap(0.0, 0.0)
    return Overlap(len(kept) / len(source), float(np.linalg.eigvalsh(kept.T @ kept / len(kept))[0]))


def share_on(sample: Cloud, target: Cloud, T_target_source: Array, voxel_m: float) -> float:
    """Share of a sample whose surfaces lie on the target's: face the same way, and are an eighth of a coarse
    voxel off at most, along the normal."""
    moved_m = transform(T_target_source, sample.points_m)
    distance_m, nearest = target.nearest(moved_m, voxel_m)
    near = np.flatnonzero(np.isfinite(distance_m))
    normals = target.normals[nearest[near]]
    turned = sample.normals[near] @ T_target_source[:3, :3].T
    off_m = np.einsum("ij,ij->i", moved_m[near] - target.points_m[nearest[near]], normals)
    on = (np.einsum("ij,ij->i", turned, normals) > AGREEING_NORMALS) & (np.abs(off_m) < voxel_m / 8)
    return float(on.sum()) / len(sample)
