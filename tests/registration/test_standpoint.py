"""Where scanners stood, against where they did; and what follows for scans in a site's frame."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from artifacts import store
from schemas.contract import Vector3
from schemas.registered_model import RegisteredModel
from schemas.settings import RegistrationSettings, SurfaceSettings
from tasks.registration.read_scan import read_scan, scan_blocks
from tasks.registration.rigid_motion import transform
from tasks.registration.standpoint import likely_standpoint, standpoint
from tasks.registration.station_cloud import fine_cloud
from tasks.registration.task import ingest_scan, register
from tasks.surfaces.task import extract
from tests.development_data import development_data
from tests.registration.site import BRIDGE, POSITIONS_M, points_seen, pose_of
from tests.surfaces.scanner import Box, scan

OFF_M = np.array([120.0, 80.0, 5.0])  # of the site's frame


@pytest.fixture(autouse=True)
def a_store() -> Iterator[None]:
    with store.temporary():
        yield


def test_a_scan_has_one_range_a_direction_and_merged_scans_have_many() -> None:
    boxes = [Box((-3.0, 4.0, 0.0), (3.0, 5.0, 4.0)), Box((-20.0, -20.0, -0.5), (20.0, 20.0, 0.0))]
    stations = [(-6.0, 0.0, 1.7), (6.0, 1.0, 1.7), (0.0, 12.0, 1.7)]
    alone = scan(boxes, stations[:1], step_deg=1.0).points
    merged = scan(boxes, stations, step_deg=1.0).points
    stood, origin = np.array(stations[0]), np.zeros(3)
    assert standpoint(alone, [origin, stood]) is stood
    assert standpoint(merged, [origin]) is None
    assert standpoint(alone + np.array([900.0, 300.0, 0.0]), [origin]) is None


@pytest.mark.parametrize("station", range(4))
def test_a_scanner_stood_in_the_middle_of_what_it_saw(station: int) -> None:
    likely = likely_standpoint(points_seen(BRIDGE, pose_of(station), station))
    assert likely is not None
    assert np.linalg.norm(likely) < 1.5


@pytest.mark.parametrize(
    "name", ["rooms/room_scan1.pcd", "street_pair/source.ply", "car_pair/car_cloud401.csv"]
)
def test_real_scanners_stood_there_too(name: str) -> None:
    cloud, _, _ = fine_cloud(scan_blocks(development_data("scans") / name), 0.02)
    points_m = cloud.points_m.astype(np.float64)
    likely = likely_standpoint(points_m)
    assert likely is not None
    assert np.linalg.norm(likely) < 1.5
    found = standpoint(points_m, [np.array([20.0, 0.0, 0.0]), np.zeros(3)])
    assert found is not None
    assert not found.any()


def registered(
    folder: Path, stations: tuple[int, ...], off_m: np.ndarray, position_m: Vector3 | None = None
) -> RegisteredModel:
    """The site's scans as text files in the frame of the whole, moved by `off_m`."""
    scans = []
    for k in stations:
        path = folder / f"{k}.xyz"
        np.savetxt(path, transform(pose_of(k), points_seen(BRIDGE, pose_of(k), k)) + off_m, fmt="%.4f")
        scans += ingest_scan.bare(store.current().put(path), str(k), 1.0, position_m, None)
    return register.bare(tuple(scans), RegistrationSettings())


@pytest.mark.parametrize("stations", [(0, 1, 3), (1,)])
def test_scans_in_a_sites_frame_face_their_scanners(tmp_path: Path, stations: tuple[int, ...]) -> None:
    model = registered(tmp_path, stations, OFF_M)
    for station in model.stations:
        assert station.scanner_m is None
        assert np.abs(np.array(station.T_world_scan) - np.eye(4)).max() < 0.01  # as they were exported
    cloud = read_scan(store.current().path(model.cloud))
    assert cloud.normals is not None
    seen_m = np.min(
        [np.linalg.norm(cloud.points_m - OFF_M - POSITIONS_M[k], axis=1) for k in stations], axis=0
    )
    facing = np.max(
        [np.einsum("ij,ij->i", cloud.normals, POSITIONS_M[k] + OFF_M - cloud.points_m) for k in stations],
        axis=0,
    )
    assert (facing > 0)[seen_m < 20].mean() > 0.99
    surfaces = {s.name: s for s in extract.bare(model, SurfaceSettings()).surfaces}
    ground = max((s for name, s in surfaces.items() if name.startswith("ground")), key=lambda s: s.area_m2)
    assert ground.plane.normal[2] > 0.99
    assert ground.origin_m[2] == pytest.approx(OFF_M[2], abs=0.02)
    soffit = max((s for name, s in surfaces.items() if name.startswith("soffit")), key=lambda s: s.area_m2)
    assert soffit.origin_m[2] == pytest.approx(OFF_M[2] + 5.0, abs=0.02)


@pytest.mark.parametrize("off_m", [OFF_M, np.array([512_345.0, 5_412_345.0, 210.0])], ids=["site", "UTM"])
def test_a_stated_scanner_counts_in_the_frame_of_its_scan(tmp_path: Path, off_m: np.ndarray) -> None:
    x, y, z = (POSITIONS_M[1] + off_m).tolist()
    model = registered(tmp_path, (1,), off_m, (x, y, z))
    structure = extract.bare(model, SurfaceSettings())
    assert np.allclose(structure.stations_m, (x, y, z) - np.array(model.origin_m), atol=1e-4)
    low_m = np.array(model.min_m) + model.origin_m - off_m
    assert np.allclose(low_m, [-30.0, -36.0, 0.0], atol=8.0)
    moved = registered(tmp_path, (1,), off_m, (x + 12.0, y, z))
    assert off_m[0] < 1000 or moved.stations[0].scanner_m is None  # a typing error is no place to look from


def test_the_viewpoint_of_a_pcd_is_where_its_scanner_stood(tmp_path: Path) -> None:
    points_m = transform(pose_of(1), points_seen(BRIDGE, pose_of(1), 1)) + OFF_M
    stood = (POSITIONS_M[1] + OFF_M).tolist()
    head = "VERSION .7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\n"
    head += f"WIDTH {len(points_m)}\nHEIGHT 1\nVIEWPOINT {stood[0]} {stood[1]} {stood[2]} 1 0 0 0\n"
    head += f"POINTS {len(points_m)}\nDATA binary\n"
    path = tmp_path / "view.pcd"
    path.write_bytes(head.encode() + points_m.astype("<f4").tobytes())
    scans = ingest_scan.bare(store.current().put(path), "view", 1.0, None, None)
    structure = extract.bare(register.bare(scans, RegistrationSettings()), SurfaceSettings())
    assert np.allclose(structure.stations_m, stood, atol=1e-4)
