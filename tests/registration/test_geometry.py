"""Rigid motions, voxels, overlap, fine alignment, pose graph and world frame, against what they must be."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from artifacts.cloud_sample import cloud_sample
from tasks.registration import cloud_shelf, world_frame
from tasks.registration.cloud_shelf import Shelf
from tasks.registration.icp import align
from tasks.registration.merged_model import merge
from tasks.registration.overlap import overlapping
from tasks.registration.pose_graph import Edge, covariances, optimise, spanning_start
from tasks.registration.read_scan import read_scan
from tasks.registration.rigid_motion import (
    Array,
    adjoint,
    angle_deg,
    exp,
    fit,
    inverse,
    log,
    pose,
    transform,
    yaw,
)
from tasks.registration.station_cloud import Cloud
from tasks.registration.voxel_grid import Accumulator, voxel_keys, voxel_sums

small = st.lists(st.floats(-1.5, 1.5), min_size=6, max_size=6).map(np.array)


@given(small, small)
@settings(max_examples=50)
def test_exp_log_and_adjoint_belong_together(xi: Array, eta: Array) -> None:
    T = exp(xi)
    assert np.allclose(T @ inverse(T), np.eye(4), atol=1e-12)
    assert np.allclose(log(T), xi, atol=1e-6)
    assert np.allclose(T @ exp(0.1 * eta) @ inverse(T), exp(adjoint(T) @ (0.1 * eta)), atol=1e-9)


def test_fit_finds_the_motion() -> None:
    points = np.random.default_rng(0).normal(size=(20, 3))
    T = exp(np.array([0.3, -2.0, 0.5, 4.0, 5.0, 6.0]))
    assert np.allclose(fit(points, transform(T, points)), T, atol=1e-12)


def test_voxel_means_do_not_depend_on_order() -> None:
    points = np.random.default_rng(0).uniform(-2, 2, (500, 3))
    order = np.random.default_rng(1).permutation(500)
    means = voxel_sums(voxel_keys(points, 0.5), points).means
    assert len(means) == len(np.unique(np.floor(points / 0.5), axis=0))
    block_by_block = Accumulator()
    for block in np.array_split(points[order], 7):
        block_by_block.add(voxel_sums(voxel_keys(block, 0.5), block))
    total = block_by_block.total()
    assert np.allclose(means, total.means)
    assert total.counts.sum() == 500
    assert np.array_equal(np.floor(means / 0.5), np.unique(np.floor(points / 0.5), axis=0))


def test_a_stray_point_far_away_joins_no_voxel() -> None:
    keys = voxel_keys(np.array([[0.0, 0.0, 0.0], [1e8, 0.0, 0.0], [0.0, -1e7, 0.0]]), 0.02)
    assert keys[0] > 0
    assert keys[1:].tolist() == [-1, -1]
    assert len(voxel_sums(keys, np.zeros((3, 3))).keys) == 1


def test_overlap_is_within_tau() -> None:
    """Eq. 1: of points 0.04, 0.09 and 0.2 m beside their partners, two are closer than τ = 0.1 m."""
    points = np.array([[0.0, 0, 0], [10.0, 0, 0], [20.0, 0, 0]])
    target = Cloud(points.astype(np.float32), np.zeros((3, 3), np.float32))
    T = yaw(0.7, (3.0, 2.0, 1.0))
    source = transform(inverse(T), points + np.diag([0.04, 0.09, 0.2]))
    assert overlapping(source, target, T, 0.1).tolist() == [True, True, False]


def corner(seed: int, outliers: int = 0) -> Cloud:
    """Three walls of a room corner, 3 mm noise, seen from inside."""
    rng = np.random.default_rng(seed)
    points, normals = [], []
    for axis in range(3):
        wall = rng.uniform(0, 4, (3000, 3))
        wall[:, axis] = rng.normal(0, 0.003, 3000)
        points.append(wall)
        normals.append(np.tile(np.eye(3)[axis], (3000, 1)))
    if outliers:  # a box that stands in one scan alone, before a wall
        box = rng.uniform(0, 1.5, (outliers, 3))
        box[:, 0] = 0.1
        points.append(box)
        normals.append(np.tile([1.0, 0, 0], (outliers, 1)))
    return Cloud(np.concatenate(points).astype(np.float32), np.concatenate(normals).astype(np.float32))


def test_alignment_of_a_corner_with_something_moved_in() -> None:
    truth = exp(np.array([0.02, -0.03, 0.05, 0.1, -0.08, 0.05]))
    target, seen = corner(0), corner(1, outliers=1500)
    source = Cloud(
        transform(inverse(truth), seen.points_m).astype(np.float32),
        (seen.normals @ truth[:3, :3]).astype(np.float32),
    )
    found = align(source, target, np.eye(4), (0.4, 0.2))
    assert found is not None
    apart = inverse(truth) @ found.T_target_source
    assert np.linalg.norm(apart[:3, 3]) < 0.0005
    assert angle_deg(apart) < 0.01
    assert 0.003 < found.rmse_m < 0.005  # both scans' noise
    assert align(source, target, pose(np.eye(3), (50, 0, 0)), (0.4,)) is None


def ring(stations: int) -> list[Array]:
    return [yaw(2 * np.pi * k / stations, (10 * np.cos(k), 10 * np.sin(k), 0.1 * k)) for k in range(stations)]


def ring_edges(poses: list[Array], noise: float) -> list[Edge]:
    rng = np.random.default_rng(3)
    edges = []
    for k in range(len(poses)):
        for step in (1, 2):
            j = (k + step) % len(poses)
            T = exp(rng.normal(0, noise, 6)) @ inverse(poses[k]) @ poses[j]
            edges.append(Edge(j, k, T, np.eye(6) * 1000, 1000, 0.003))
    return edges


def test_pose_graph_closes_loops_and_votes_a_wrong_pair_down() -> None:
    truth = ring(8)
    truth = [inverse(truth[0]) @ T for T in truth]
    edges = ring_edges(truth, 0.001)
    wrong = Edge(5, 1, yaw(2.0, (3.0, 1.0, 0.0)), np.eye(6) * 1000, 1000, 0.003)
    found, apart_m = optimise(spanning_start(8, edges), [*edges, wrong])
    assert max(np.linalg.norm(f[:3, 3] - t[:3, 3]) for f, t in zip(found, truth, strict=True)) < 0.02
    assert apart_m[-1] > 1.0
    assert max(apart_m[:-1]) < 0.01
    assert np.array_equal(found[0], np.eye(4))


def test_pose_graph_without_error_stays(tmp_path: Path) -> None:
    truth = [inverse(ring(5)[0]) @ T for T in ring(5)]
    edges = ring_edges(truth, 0.0)
    found, apart_m = optimise(spanning_start(5, edges), edges)
    assert all(np.allclose(f, t, atol=1e-9) for f, t in zip(found, truth, strict=True))
    assert max(apart_m) < 1e-9


def test_covariances_say_how_far_poses_are_off() -> None:
    """Rings of ten with noise in every pair: the mean of d²/6 of all stations over 20 rings is about one."""
    squares = []
    for seed in range(20):
        rng = np.random.default_rng(seed)
        truth = ring(10)
        truth = [inverse(truth[0]) @ T for T in truth]
        edges = []
        for k in range(10):
            for step in (1, 2, 3):
                j = (k + step) % 10
                T = exp(rng.normal(0, [1e-4] * 3 + [1e-3] * 3)) @ inverse(truth[k]) @ truth[j]
                edges.append(Edge(j, k, T, np.diag([1e5] * 3 + [1e3] * 3), 1000, 0.003))
        found, _ = optimise(spanning_start(10, edges), edges)
        places_m = [T[:3, 3] for T in found]
        tips = np.vstack([np.eye(3), -np.eye(3)]) * 10
        gauge = fit(
            np.concatenate([transform(T, tips) for T in found]),
            np.concatenate([transform(T, tips) for T in truth]),
        )
        for T, t, C in zip(found, truth, covariances(found, edges, places_m), strict=True):
            apart = log(gauge @ T @ inverse(t))
            error = adjoint(pose(np.eye(3), -t[:3, 3])) @ apart
            squares.append(float(error @ np.linalg.pinv(C, rcond=1e-9) @ error) / 6)
    assert 0.7 < np.mean(squares) < 1.5


def test_disconnected_pose_graph_is_refused() -> None:
    edges = ring_edges(ring(4), 0.0)[:1]
    with pytest.raises(ValueError, match="not connected"):
        optimise([np.eye(4)] * 4, edges)


def test_world_frame_outvotes_a_wrong_position() -> None:
    poses = ring(6)
    T_world_frame = yaw(1.1, (100.0, 200.0, 5.0))
    rng = np.random.default_rng(0)
    positions = [(T_world_frame @ T)[:3, 3] + rng.normal(0, 0.05, 3) for T in poses]
    positions[2] = positions[2] + [10.0, 0.0, 0.0]
    nothing: list[Array | None] = [None] * 6
    scanners: list[Array | None] = [np.zeros(3)] * 6
    found = world_frame.fit(poses, nothing, scanners, list(positions))
    assert found is not None
    assert np.linalg.norm((inverse(T_world_frame) @ found)[:3, 3]) < 0.1
    assert found[2, 2] == 1.0  # z stays up
    assert world_frame.fit(poses, nothing, scanners, [positions[0], *nothing[1:]]) is None


def test_level_is_the_mean_of_all_scanners() -> None:
    tilted = [
        exp(np.array([0.002 * np.cos(k), 0.002 * np.sin(k), 0.3 * k, 1.0 * k, 0, 0])) for k in range(40)
    ]
    base = exp(np.array([0.003, 0.0, 0.0, 0.0, 0.0, 0.0]))
    up = np.mean([(base @ T)[:3, 2] for T in tilted], axis=0)
    level = world_frame.levelled([base @ T for T in tilted])
    assert np.allclose(level[:3, :3] @ up / np.linalg.norm(up), [0, 0, 1], atol=1e-12)
    assert np.array_equal(world_frame.levelled([np.eye(4), exp(np.array([0.2, 0, 0, 0, 0, 0]))]), np.eye(4))


def test_merged_model_keeps_both_faces_of_a_plate_and_survives_writing(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    face = np.column_stack([rng.uniform(0, 1, (20000, 2)), np.full(20000, 0.012)])
    above = Cloud(face.astype(np.float32), np.tile([0, 0, 1], (20000, 1)).astype(np.float32))
    below = Cloud((face - [0, 0, 0.008]).astype(np.float32), -above.normals)  # an 8 mm plate
    shelf = Shelf(tmp_path)
    path = tmp_path / "model.ply"
    shift = pose(np.eye(3), (5.0, -5.1, 0.0))  # over the border of two tiles
    model = merge([shelf.put(above), shelf.put(below)], [shift, shift], 0.02, tmp_path, path)
    points_m, station = cloud_sample(path)
    assert np.allclose(points_m[station == 0, 2], 0.012)
    assert np.allclose(points_m[station == 1, 2], 0.004)
    assert 2 * 2400 < model.points <= 2 * 2601  # one point per 20 mm voxel and face
    assert model.points == len(points_m)
    assert np.allclose([model.low_m, model.high_m], [points_m.min(axis=0), points_m.max(axis=0)])
    again = read_scan(path)
    assert again.normals is not None
    assert np.allclose(again.normals[:, 2], np.where(station == 0, 1.0, -1.0))
    assert b"property uchar station\n" in path.read_bytes()[:400]


def test_shelf_brings_back_what_it_no_longer_holds(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cloud_shelf, "MOST_POINTS", 10_000)
    shelf = Shelf(tmp_path)
    clouds = [corner(seed) for seed in range(3)]  # of 9,000 points
    shelved = [shelf.put(cloud) for cloud in clouds]
    for one, cloud in zip(shelved, clouds, strict=True):
        assert np.array_equal(one.cloud().points_m, cloud.points_m)
        assert np.array_equal(one.cloud().normals, cloud.normals)
    assert one.cloud() is one.cloud()
