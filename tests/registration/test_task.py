"""The stages of registration: files in, model out."""

import struct
from collections.abc import Iterator
from pathlib import Path

import laspy
import numpy as np
import pytest
from laspy.vlrs.known import WktCoordinateSystemVlr

from artifacts import store
from schemas.problem import BadInput
from schemas.scan import Scan
from schemas.settings import RegistrationSettings, SurfaceSettings
from schemas.utm import utm_origin
from tasks.registration.read_scan import read_scan
from tasks.registration.rigid_motion import Array, transform, yaw
from tasks.registration.task import ingest_scan, pages, register
from tasks.surfaces.task import extract
from tests.registration.site import measured_position, pose_of


@pytest.fixture(autouse=True)
def a_store() -> Iterator[None]:
    with store.temporary():
        yield


def test_model_of_two_stations(site_folder: Path) -> None:
    scans = []
    for k in (0, 3):
        file = store.current().put(site_folder / f"station{k}.ply")
        scans += ingest_scan.bare(file, f"station{k}", 1.0, measured_position(k), None)
    model = register.bare(tuple(scans), RegistrationSettings())
    assert [s.name for s in model.stations] == ["station0", "station3"]
    assert len(model.pairs) == 1
    cloud = read_scan(store.current().path(model.cloud))
    assert len(cloud.points_m) == model.points
    assert np.allclose(cloud.points_m.min(axis=0), model.min_m)
    assert cloud.normals is not None
    assert model == register.bare(tuple(scans), RegistrationSettings())
    picture, stations, pairs = pages({}, model)
    assert picture.markdown is not None
    assert "2 stations" in picture.markdown
    assert stations.table[1]["station"] == "station3"
    assert pairs.table[0]["source"] == "station0"


def test_a_file_with_several_scans_gives_several(tmp_path: Path) -> None:
    """One without points stays among them, for `register` to leave out by name."""
    head = "2\n2\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n"
    path = tmp_path / "field.ptx"
    path.write_text(head + "0 0 0 0.5\n" * 4 + head + "1 0 0 1\n0 1 0 1\n0 0 1 1\n5 5 5 1\n")
    scans = ingest_scan.bare(store.current().put(path), "field", 1.0, None, None)
    assert [(s.name, s.index) for s in scans] == [("field-1", 0), ("field-2", 1)]
    with pytest.raises(BadInput, match="one position is stated for its 2 scans"):
        ingest_scan.bare(store.current().put(path), "field", 1.0, (1.0, 2.0, 3.0), None)
    with pytest.raises(BadInput, match=r"field-1.*field-2"):
        register.bare(scans, RegistrationSettings())


def test_unusable_file_is_refused_by_its_name(tmp_path: Path) -> None:
    path = tmp_path / "x.ply"
    path.write_text("hello")
    with pytest.raises(BadInput) as caught:
        ingest_scan.bare(store.current().put(path), "east bank", 1.0, None, None)
    assert caught.value.item == "east bank"


def test_scans_in_utm_say_where_on_earth_the_model_lies(site_folder: Path, tmp_path: Path) -> None:
    """Two LAS files in zone 32N, with half a metre between what their files say."""
    scans = []
    for k, off_m in ((0, 0.0), (3, 0.5)):
        local = read_scan(site_folder / f"station{k}.ply").points_m
        utm_m = transform(yaw(0.0, (512_300.0 + off_m, 5_402_100.0, 350.0)) @ pose_of(k), local)
        scans += ingest_scan.bare(
            store.current().put(_las(tmp_path / f"{k}.las", utm_m, "WGS 84 / UTM zone 32N")),
            str(k),
            1.0,
            None,
            None,
        )
    assert [scan.utm_zone for scan in scans] == ["32N", "32N"]
    model = register.bare(tuple(scans), RegistrationSettings())
    assert model.utm_zone == "32N"
    assert model.origin_m == (512_300.0, 5_402_100.0, 0.0)
    assert len(model.pairs) == 1
    structure = extract.bare(model, SurfaceSettings())
    origin = structure.geo_origin()
    assert origin is not None
    assert origin == utm_origin("32N", model.origin_m)
    assert structure.geo_origin("31N") != origin
    # in the datum of control targets, nobody knows the zone
    here = model.model_copy(update={"utm_zone": None})
    assert extract.bare(here, SurfaceSettings()).geo_origin() is None


def test_a_state_plane_says_its_unit_by_its_number(tmp_path: Path) -> None:
    """New York Long Island in survey feet, 300 of them a side; California zone 3 is in metres, and no UTM
    zone; New York of 2011 may be either."""
    points = np.random.default_rng(0).uniform(0, 300, (5000, 3)) + np.array([980_000, 190_000, 0])

    def ingested(code: int, unit_m: float = 1.0) -> Scan:
        header = laspy.LasHeader(point_format=3, version="1.2")
        header.offsets, header.scales = points.min(axis=0), np.full(3, 0.01)
        keys = struct.pack("<12H", 1, 1, 0, 2, 1024, 0, 1, 1, 3072, 0, 1, code)
        header.vlrs.append(laspy.VLR("LASF_Projection", 34735, "", keys))
        las = laspy.LasData(header)
        las.x, las.y, las.z = points.T
        las.write(tmp_path / f"{code}.las")
        file = store.current().put(tmp_path / f"{code}.las")
        return ingest_scan.bare(file, str(code), unit_m, None, None)[0]

    assert ingested(2263).unit_m == pytest.approx(1200 / 3937, abs=1e-9)
    assert (ingested(26943).unit_m, ingested(26943).utm_zone) == (1.0, None)
    assert (ingested(26910).unit_m, ingested(26910).utm_zone) == (1.0, "10N")
    with pytest.raises(BadInput, match="6539: it states the state plane EPSG:6539 without a unit"):
        ingested(6539)
    assert ingested(6539, 0.3048).unit_m == 0.3048


def _las(path: Path, points_m: Array, system: str) -> Path:
    header = laspy.LasHeader(point_format=6, version="1.4")
    header.offsets, header.scales = points_m.min(axis=0), np.full(3, 1e-4)
    header.vlrs.append(WktCoordinateSystemVlr(f'PROJCS["{system}",UNIT["metre",1]]'))
    las = laspy.LasData(header)
    las.x, las.y, las.z = points_m.T
    las.write(path)
    return path


def test_a_file_that_breaks_off_is_used_and_named(site_folder: Path, tmp_path: Path) -> None:
    points = read_scan(site_folder / "station0.ply").points_m[::8]
    text = "".join(f"{x:.4f} {y:.4f} {z:.4f}\n" for x, y, z in points)
    path = tmp_path / "cut.xyz"
    path.write_text(text[:-12])
    scans = ingest_scan.bare(store.current().put(path), "cut.xyz", 1.0, None, None)
    model = register.bare(scans, RegistrationSettings())
    assert [station.name for station in model.stations] == ["cut.xyz"]
    assert [(one.item, one.stage) for one in model.left_out] == [("the end of cut.xyz", "registration")]
