"""Scans that are sparse, full of dust, or of an unknown scanner."""

from pathlib import Path

import numpy as np
import pytest

from schemas.file import File
from schemas.problem import BadInput
from schemas.scan import Scan
from tasks.registration.cloud_shelf import Shelf
from tasks.registration.read_scan import LoadedScan
from tasks.registration.rigid_motion import Array
from tasks.registration.station_cloud import Cloud, coarse_voxel_m, estimated_normals, fine_cloud, on_surfaces
from tasks.registration.station_site import site
from tasks.registration.visibility import range_image
from tests.registration.site import BRIDGE, points_seen, pose_of


def test_points_too_far_apart_to_show_a_surface_are_refused_by_name(tmp_path: Path) -> None:
    points_m = np.random.default_rng(0).uniform(0, 3000, (1000, 3)) * [1, 1, 0.01]
    scan = Scan(name="thin.las", file=File(sha256="0" * 64, size=1, suffix=".las"), index=0)
    blocks = [LoadedScan(points_m, None, None, np.zeros(3), np.zeros(3))]
    with pytest.raises(BadInput, match=r"thin\.las: too few points"):
        site(scan, blocks, 0.02, Shelf(tmp_path))


def cloud(points_m: Array) -> Cloud:
    return Cloud(points_m.astype(np.float32), estimated_normals(points_m).astype(np.float32))


def test_dust_neither_coarsens_a_scan_nor_stays_in_it() -> None:
    scan_m = points_seen(BRIDGE, pose_of(0), 0)
    rng = np.random.default_rng(1)
    dust_m = rng.uniform(scan_m.min(axis=0), scan_m.max(axis=0), (len(scan_m) // 10, 3))
    clean, dusty = cloud(scan_m), cloud(np.concatenate([scan_m, dust_m]))
    scanner_m = np.zeros(3)
    voxel_m = coarse_voxel_m(clean, scanner_m)
    assert coarse_voxel_m(dusty, scanner_m) < 1.25**2.5 * voxel_m
    kept = on_surfaces(dusty, voxel_m).points_m
    is_dust = np.isin(kept[:, 0], dust_m[:, 0].astype(np.float32))
    assert is_dust.sum() < 0.2 * len(dust_m)
    assert (~is_dust).sum() > 0.97 * len(scan_m)


def test_a_thinned_scan_is_taken_coarser_and_still_tells_what_is_empty() -> None:
    scan_m = points_seen(BRIDGE, pose_of(0), 0)
    thin_m = scan_m[np.random.default_rng(2).random(len(scan_m)) < 0.05]
    thinner_m = thin_m[::5]
    assert coarse_voxel_m(cloud(thinner_m), np.zeros(3)) > coarse_voxel_m(cloud(scan_m), np.zeros(3))
    image = range_image(cloud(thin_m), np.zeros(3))
    assert image is not None
    assert image.cell_deg > 1.5
    through, met = image.judge(scan_m)
    assert met.sum() > 5_000
    assert through.sum() < 0.01 * met.sum()
    assert image.judge(0.5 * thin_m)[0].mean() > 0.1  # half-way to what was met there is air


def test_walls_face_the_middle_where_the_scanner_is_not_known() -> None:
    scan_m = points_seen(BRIDGE, pose_of(0), 0)
    with_scanner, without = (
        fine_cloud([LoadedScan(scan_m, None, None, scanner_m, np.zeros(3))], 0.02)[0]
        for scanner_m in (np.zeros(3), None)
    )
    wall = np.abs(with_scanner.normals[:, 2]) < 0.3
    same = np.einsum("ij,ij->i", with_scanner.normals, without.normals)[wall] > 0
    assert same.mean() > 0.75  # by chance it is a half
