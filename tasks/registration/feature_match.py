"""Coarse alignment where no pose is known: local shape features and the rigid motions on which many agree.

Features: FPFH (Rusu 2009). Motions: second-order spatial compatibility (SC²-PCR, Chen et al. 2022): two
matches are compatible where they keep their distance, and a match is worth the compatible matches that its
compatible partners share with it. No random sampling, so the same answer every time.
"""

import numpy as np
import numpy.typing as npt
import open3d as o3d

from tasks.registration.rigid_motion import Array, fit, transform
from tasks.registration.station_cloud import Cloud

Features = npt.NDArray[np.float32]
MOST_MATCHES = 2500
SEEDS = 150
AGREEING = 30  # matches that a seed's first motion is fitted to


def shape_features(cloud: Cloud, radius_m: float) -> Features:
    """(N, 33) FPFH of each point within the radius, as unit vectors."""
    points = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(cloud.points_m.astype(np.float64)))
    points.normals = o3d.utility.Vector3dVector(cloud.normals.astype(np.float64))
    feature = o3d.pipelines.registration.compute_fpfh_feature(  # type: ignore[call-arg]  # stub is wrong
        points, o3d.geometry.KDTreeSearchParamHybrid(radius=radius_m, max_nn=100)
    )
    values = np.sqrt(np.maximum(np.asarray(feature.data).T, 0.0))  # Hellinger: no bin drowns the others
    length = np.linalg.norm(values, axis=1, keepdims=True)
    return np.asarray(values / np.where(length > 0, length, 1.0), dtype=np.float32)


def matches(source: Features, target: Features) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]]:
    """Pairs that are each other's most alike, the most alike first."""
    to_target = (source @ target.T).argmax(axis=1)
    to_source = (target @ source.T).argmax(axis=1)  # along rows: five times as fast as down columns
    mutual = np.flatnonzero(to_source[to_target] == np.arange(len(source)))
    likeness = np.einsum("ij,ij->i", source[mutual], target[to_target[mutual]])
    order = np.argsort(-likeness, kind="stable")[:MOST_MATCHES]
    return mutual[order], to_target[mutual[order]]


def motions(source_m: Array, target_m: Array, tolerance_m: float, best: int) -> list[Array]:
    """The `best` distinct T_target_source of (N, 3) matched points, those first on which most agree."""
    if len(source_m) < 10:
        return []
    kept_m = np.abs(_distances(source_m) - _distances(target_m))
    compatible = (kept_m < tolerance_m).astype(np.float32)
    np.fill_diagonal(compatible, 0.0)
    second_order = compatible * (compatible @ compatible)
    worth = second_order.sum(axis=1)
    seeds = np.argsort(-worth, kind="stable")[:SEEDS]
    found: list[tuple[int, Array]] = []
    for seed in seeds:
        partners = np.argsort(-second_order[seed], kind="stable")[:AGREEING]
        partners = np.append(partners[second_order[seed, partners] > 0], seed)
        if len(partners) < 4:
            continue
        T = fit(source_m[partners], target_m[partners])
        for _ in range(3):
            agree = np.linalg.norm(transform(T, source_m) - target_m, axis=1) < 1.5 * tolerance_m
            if agree.sum() < 4:
                break
            T = fit(source_m[agree], target_m[agree])
        found.append((int(agree.sum()), T))
    found.sort(key=lambda item: -item[0])
    distinct: list[Array] = []
    spread = source_m[:: max(1, len(source_m) // 50)]
    for _, T in found:
        if all(
            np.linalg.norm(transform(T, spread) - transform(other, spread), axis=1).mean() > 2 * tolerance_m
            for other in distinct
        ):
            distinct.append(T)
        if len(distinct) == best:
            break
    return distinct


def _distances(points_m: Array) -> npt.NDArray[np.float32]:
    p = (points_m - points_m.mean(axis=0)).astype(np.float32)
    square = (p * p).sum(axis=1)
    return np.asarray(np.sqrt(np.maximum(square[:, None] + square[None, :] - 2 * p @ p.T, 0.0)))
