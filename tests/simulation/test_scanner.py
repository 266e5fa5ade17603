from pathlib import Path

import numpy as np
import pytest

from tasks.simulation.bridge import INSPECTED, bridge
from tasks.simulation.scanner import QUIET, Sweep, scan, write_ply


@pytest.fixture(scope="module")
def sweeps() -> list[Sweep]:
    return list(scan(bridge(1), lambda _: None))


def in_world(sweep: Sweep) -> np.ndarray:
    T = sweep.T_world_scan
    return sweep.points.astype(float) @ T[:3, :3].T + T[:3, 3]


def test_six_stations_of_a_hundred_thousand_points_or_more(sweeps: list[Sweep]) -> None:
    assert len(sweeps) == 6
    assert all(100_000 < len(s.points) < 350_000 for s in sweeps)


def test_points_lie_on_the_true_faces_with_3_mm_noise_in_range(sweeps: list[Sweep]) -> None:
    for name in INSPECTED:
        face = bridge(1).face(name)
        errors = []
        for sweep in sweeps:
            points = in_world(sweep)
            u, v, w = face.to_face(points).T
            on = (u > 0.02) & (v > 0.02) & (u < face.width_m - 0.02) & (v < face.height_m - 0.02)
            on &= np.abs(w) < 0.02
            rays = points[on] - sweep.T_world_scan[:3, 3]
            slant = np.abs(rays @ face.normal) / np.linalg.norm(rays, axis=1)
            errors.append(w[on][slant > 0.3] / slant[slant > 0.3])
        along_ray = np.concatenate(errors)
        assert len(along_ray) > 3000, name
        assert along_ray.std() == pytest.approx(QUIET.range_sigma_m, rel=0.1)
        assert abs(along_ray.mean()) < 0.0004


def test_frames_are_levelled_and_turned_at_will(sweeps: list[Sweep]) -> None:
    for sweep in sweeps:
        R = sweep.T_world_scan[:3, :3]
        np.testing.assert_allclose(R @ R.T, np.eye(3), atol=1e-12)
        assert np.degrees(np.arccos(R[2, 2])) < 0.1
    yaws = [np.degrees(np.arctan2(s.T_world_scan[1, 0], s.T_world_scan[0, 0])) for s in sweeps]
    assert np.ptp(yaws) > 90


def test_stations_are_measured_5_cm_off(sweeps: list[Sweep]) -> None:
    off = np.array([np.subtract(s.measured_m, s.T_world_scan[:3, 3]) for s in sweeps])
    assert 0.5 * QUIET.station_sigma_m < off.std() < 1.6 * QUIET.station_sigma_m


def test_the_same_seed_gives_the_same_scans(sweeps: list[Sweep]) -> None:
    again = next(scan(bridge(1), lambda _: None))
    np.testing.assert_array_equal(again.points, sweeps[0].points)


def test_ply_is_read_back_by_open3d(sweeps: list[Sweep], tmp_path: Path) -> None:
    import open3d as o3d

    path = tmp_path / "scan.ply"
    write_ply(sweeps[0].points, path)
    back = np.asarray(o3d.io.read_point_cloud(str(path)).points)
    np.testing.assert_array_equal(back.astype(np.float32), sweeps[0].points)
