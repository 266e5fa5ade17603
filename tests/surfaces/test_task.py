"""The stage on files: a synthetic wall, and real scans where they are at hand."""

from pathlib import Path

import numpy as np
import numpy.typing as npt
import open3d as o3d
import pytest

from artifacts import store
from schemas.problem import BadInput
from schemas.registered_model import RegisteredModel, Station
from schemas.settings import SurfaceSettings
from schemas.structure import Structure
from tasks.surfaces.cloud import read_cloud
from tasks.surfaces.task import extract, measure_relief, pages, relief_pages
from tests.development_data import development_data
from tests.surfaces.scanner import Box, scan
from tests.surfaces.test_cloud import write_ply

UNMOVED = ((1.0, 0.0, 0.0, 0.0), (0.0, 1.0, 0.0, 0.0), (0.0, 0.0, 1.0, 0.0), (0.0, 0.0, 0.0, 1.0))


def model_of(points: npt.NDArray[np.float64], path: Path) -> RegisteredModel:
    """One station at the origin, no normals: the least that a model can say."""
    cloud = store.current().put(write_ply(path, dict(zip("xyz", points.T, strict=True))))
    low, high = points.min(axis=0).tolist(), points.max(axis=0).tolist()
    station = Station(name="s1", T_world_scan=UNMOVED, points=len(points), scanner_m=(0.0, 0.0, 0.0))
    return RegisteredModel(cloud=cloud, stations=(station,), points=len(points), min_m=low, max_m=high)


@pytest.fixture
def wall(tmp_path: Path) -> RegisteredModel:
    return model_of(
        scan([Box((-2.0, 5.0, -1.0), (2.0, 5.3, 2.0))], [(0.0, 0.0, 0.0)]).points, tmp_path / "w.ply"
    )


@pytest.fixture(autouse=True)
def shelf() -> store.Store:
    with store.temporary() as temporary:
        yield temporary


def test_a_wall_from_file_to_structure(wall: RegisteredModel, shelf: store.Store) -> None:
    structure = extract.bare(wall, SurfaceSettings())
    assert [s.name for s in structure.surfaces] == ["wall-south-01"]
    assert structure.surfaces[0].area_m2 == pytest.approx(12.0, rel=0.03)
    occupied = o3d.io.read_point_cloud(str(shelf.path(structure.occupied)))
    assert np.asarray(occupied.points)[:, 1] == pytest.approx(5.0, abs=0.02)
    assert Structure.model_validate_json(structure.model_dump_json()) == structure


def test_a_few_echoes_far_off_are_no_part_of_the_model(wall: RegisteredModel, tmp_path: Path) -> None:
    points = read_cloud(store.current().path(wall.cloud), "wall", np.zeros((1, 3))).points
    far_m = np.array([[11_000.0, 0.0, 0.0], [0.0, -30_000.0, 500.0]])
    clean = extract.bare(wall, SurfaceSettings())
    with_echoes = extract.bare(model_of(np.vstack([points, far_m]), tmp_path / "far.ply"), SurfaceSettings())
    assert with_echoes.surfaces == clean.surfaces
    assert (with_echoes.min_m, with_echoes.max_m) == (clean.min_m, clean.max_m)


def test_the_result_is_the_same_bytes_again(wall: RegisteredModel) -> None:
    one, two = (extract.bare(wall, SurfaceSettings()) for _ in range(2))
    assert one.model_dump_json() == two.model_dump_json()


def test_pages_show_a_picture_and_a_table(wall: RegisteredModel) -> None:
    picture, table = pages({}, extract.bare(wall, SurfaceSettings()))
    assert "data:image/jpeg;base64," in (picture.markdown or "")
    assert [row["surface"] for row in table.table] == ["wall-south-01"]


def test_a_wall_that_bulges_has_a_relief_and_a_flat_one_none(
    wall: RegisteredModel, shelf: store.Store, tmp_path: Path
) -> None:
    flat = extract.bare(wall, SurfaceSettings()).surfaces
    assert measure_relief.bare(wall, flat) == ()
    grid = np.stack(np.meshgrid(np.arange(-2, 2, 0.02), np.arange(-1, 2, 0.02)), axis=-1).reshape(-1, 2)
    bulge_m = 0.03 * np.exp(-((grid - [0.0, 0.5]) ** 2).sum(axis=1) / 0.5**2)
    points = np.column_stack([grid[:, 0], 5.0 - bulge_m, grid[:, 1]])  # towards the scanner
    (relief,) = measure_relief.bare(model_of(points, tmp_path / "bulge.ply"), flat)
    w_m = np.load(shelf.path(relief.heights))
    assert relief.surface == "wall-south-01"
    assert w_m.max() - np.median(w_m) == pytest.approx(0.03, abs=0.003)
    r, c = np.unravel_index(int(np.argmax(w_m)), w_m.shape)
    place = flat[0].to_world([(relief.left_m + c * relief.cell_m, relief.bottom_m + r * relief.cell_m)])[0]
    np.testing.assert_allclose(place[[0, 2]], [0.0, 0.5], atol=2 * relief.cell_m)
    (page,) = relief_pages({}, (relief,))
    assert "Relief of wall-south-01" in (page.markdown or "")
    assert "data:image/jpeg;base64," in (page.markdown or "")


def test_a_model_without_surfaces_names_its_stations(tmp_path: Path) -> None:
    bush = np.random.default_rng(0).normal(size=(2000, 3)) + np.array([0.0, 5.0, 0.0])
    with pytest.raises(BadInput, match="model of s1: no flat surface"):
        extract.bare(model_of(bush, tmp_path / "bush.ply"), SurfaceSettings())


def test_a_real_room_has_floor_ceiling_and_walls(tmp_path: Path) -> None:
    path = development_data("scans/rooms") / "room_scan1.pcd"
    points = np.asarray(o3d.io.read_point_cloud(str(path)).points)
    structure = extract.bare(model_of(points, tmp_path / "room.ply"), SurfaceSettings(distance_m=0.04))
    largest = {}
    for surface in sorted(structure.surfaces, key=lambda s: s.area_m2):
        largest[surface.name.rsplit("-", 1)[0]] = surface
    floor, ceiling = largest["ground"], largest["soffit"]
    assert floor.area_m2 > 20
    assert ceiling.area_m2 > 30
    assert ceiling.origin_m[2] - floor.origin_m[2] == pytest.approx(2.97, abs=0.1)
    assert largest["wall-north"].area_m2 > 8  # facing north: the room's south wall
    assert largest["wall-south"].area_m2 > 6
    assert abs(np.dot(largest["wall-north"].plane.normal, largest["wall-south"].plane.normal) + 1) < 0.002


@pytest.mark.parametrize("name", ["car_pair/car_cloud400.csv", "street_pair/source.ply"])
def test_real_outdoor_scans_have_ground_and_obstacles(name: str, tmp_path: Path) -> None:
    path = development_data("scans") / name
    if path.suffix == ".csv":
        points = np.loadtxt(path, delimiter=",", skiprows=1, usecols=(0, 1, 2))
    else:
        points = np.asarray(o3d.io.read_point_cloud(str(path)).points)
    structure = extract.bare(model_of(points, tmp_path / "s.ply"), SurfaceSettings(distance_m=0.04))
    ground = [s for s in structure.surfaces if s.name.startswith("ground")]
    assert max(s.area_m2 for s in ground) > 40
    assert len(structure.obstacles) > 10
    assert all(s.area_m2 >= 0.5 for s in structure.surfaces)
