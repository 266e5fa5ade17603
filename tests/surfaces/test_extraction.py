"""Surfaces and obstacles of a scanned girder bridge against its true faces."""

import numpy as np
import pytest
import shapely
from scipy.spatial import cKDTree

from schemas.problem import BadInput
from schemas.settings import SurfaceSettings
from schemas.surface import Surface
from tasks.surfaces.cloud import Cloud, unit
from tasks.surfaces.extraction import Extraction, extract_structure
from tasks.surfaces.naming import middle_m
from tests.surfaces.girder_bridge import BOXES, CRATE, STATIONS, Face, faces
from tests.surfaces.scanner import Box, in_view, scan


def extract(cloud: Cloud, **settings: object) -> Extraction:
    return extract_structure(cloud, SurfaceSettings(**settings), "bridge", lambda fraction: None)


@pytest.fixture(scope="module")
def cloud() -> Cloud:
    return scan(BOXES, STATIONS)


@pytest.fixture(scope="module")
def bridge(cloud: Cloud) -> Extraction:
    return extract(cloud)


def overlap(surface: Surface, face: Face) -> float:
    """Intersection over union; 0 where they are not the same plane within 5 cm and 5°."""
    if np.dot(surface.plane.normal, face.normal) < np.cos(np.radians(5)):
        return 0.0
    rings = [surface.to_world(ring) for ring in (surface.outline_m, *surface.holes_m)]
    if abs(np.median(rings[0][:, face.axis]) - face.value_m) > 0.05:
        return 0.0
    flat = [ring[:, face.others] for ring in rings]
    polygon = shapely.Polygon(flat[0], flat[1:]).buffer(0)
    return float(polygon.intersection(face.polygon).area / polygon.union(face.polygon).area)


def angle_deg(surface: Surface, face: Face) -> float:
    return float(np.degrees(np.arccos(min(1.0, np.dot(surface.plane.normal, face.normal)))))


def matches(bridge: Extraction) -> list[tuple[Surface, Face]]:
    found = []
    for face in faces():
        best = max(bridge.surfaces, key=lambda surface: overlap(surface, face))
        if overlap(best, face) > 0.5:
            found.append((best, face))
    return found


def test_finds_the_faces_and_little_else(bridge: Extraction) -> None:
    found = matches(bridge)
    inspected = [s for s in bridge.surfaces if not s.name.startswith("ground")]
    assert len(found) / len(faces()) >= 0.9
    assert len({s.name for s, _ in found}) / len(inspected) >= 0.9


def test_planes_are_right_to_a_tenth_of_a_degree_and_3_mm(bridge: Extraction) -> None:
    pairs = [(s, f) for s, f in matches(bridge) if s.points >= 500]
    assert len(pairs) >= 25
    assert max(angle_deg(s, f) for s, f in pairs) <= 0.1
    offsets_m = [abs(s.to_world([np.mean(s.outline_m, axis=0)])[0, f.axis] - f.value_m) for s, f in pairs]
    assert max(offsets_m) <= 0.003
    assert np.median([s.rms_m for s, _ in pairs]) == pytest.approx(0.002, abs=0.0015)


def seen_m2(face: Face) -> float:
    """Area of the face that a station sees, by 2,000 samples."""
    rng = np.random.default_rng(0)
    low, high = np.array(face.polygon.bounds[:2]), np.array(face.polygon.bounds[2:])
    flat = rng.uniform(low, high, (4000, 2))
    flat = flat[shapely.contains_xy(face.polygon, *flat.T)]
    points_m = np.empty((len(flat), 3))
    points_m[:, face.others] = flat
    points_m[:, face.axis] = face.value_m + 0.001 * face.sign
    return float(in_view(BOXES, STATIONS, points_m).mean()) * face.polygon.area


def test_area_is_what_the_scanners_saw(bridge: Extraction) -> None:
    pairs = [(s, f) for s, f in matches(bridge) if s.points >= 500 and s.area_m2 > 2.0]
    assert len(pairs) >= 25
    errors = np.array([s.area_m2 / seen_m2(f) - 1 for s, f in pairs])
    assert abs(np.median(errors)) <= 0.03
    assert np.quantile(np.abs(errors), 0.9) <= 0.10


def test_surfaces_face_the_scanners_and_have_a_right_handed_frame(bridge: Extraction) -> None:
    for surface in bridge.surfaces:
        np.testing.assert_allclose(np.cross(surface.u, surface.v), surface.plane.normal, atol=1e-12)
        assert surface.plane.signed_distance_m(STATIONS).max() > 0
        corners = surface.to_world(surface.outline_m)
        np.testing.assert_allclose(surface.plane.signed_distance_m(corners), 0.0, atol=1e-6)
        assert shapely.LinearRing(surface.outline_m).is_ccw
        assert shapely.Polygon(surface.hull_m).area >= 0.9 * surface.area_m2
        assert surface.area_m2 == pytest.approx(
            shapely.Polygon(surface.outline_m, surface.holes_m).area, rel=1e-3
        )


def test_the_ground_is_named_and_is_one(bridge: Extraction) -> None:
    ground = [s for s in bridge.surfaces if s.name.startswith("ground")]
    assert [s.name for s in ground] == ["ground-01"]
    assert ground[0].plane.normal[2] == pytest.approx(1.0, abs=1e-5)
    assert ground[0].area_m2 == pytest.approx(30 * 28 - 4 * 1.6, rel=0.1)  # corners are thinly scanned


def test_a_small_crate_is_an_obstacle_with_its_extent(bridge: Extraction) -> None:
    near = [
        o for o in bridge.obstacles if np.all(np.less(o.min_m, CRATE.max_m)) and o.max_m[0] > CRATE.min_m[0]
    ]
    near = [o for o in near if o.max_m[1] > CRATE.min_m[1]]
    assert len(near) == 1
    assert near[0].max_m == pytest.approx(CRATE.max_m, abs=0.05)
    assert near[0].min_m[:2] == pytest.approx(CRATE.min_m[:2], abs=0.05)


def test_everything_solid_is_occupied(bridge: Extraction, cloud: Cloud) -> None:
    distance_m = cKDTree(bridge.occupied_m).query(cloud.points[::50])[0]
    assert np.quantile(distance_m, 0.999) <= 0.06  # strays apart
    assert distance_m.max() <= 0.25


def test_names_stay_with_other_noise_another_seed_and_shuffled_points(bridge: Extraction) -> None:
    cloud = scan(BOXES, STATIONS, seed=7)
    other = extract(cloud[np.random.default_rng(1).permutation(len(cloud))], seed=3)
    assert [s.name for s in other.surfaces] == [s.name for s in bridge.surfaces]
    for one, two in zip(bridge.surfaces, other.surfaces, strict=True):
        assert middle_m(two) == pytest.approx(middle_m(one), abs=0.3)
        assert np.dot(one.plane.normal, two.plane.normal) > np.cos(np.radians(1.0))


def test_each_of_the_papers_steps_can_be_switched_off() -> None:
    wall = scan([Box((0.0, 5.0, 0.0), (4.0, 5.3, 3.0))], [(2.0, 0.0, 1.5)])
    for off in ({"noise_filter": False}, {"voxel_m": None}, {"clustering": False}):
        found = extract(wall, **off)
        assert [s.name for s in found.surfaces] == ["wall-south-01"]
        assert found.surfaces[0].area_m2 == pytest.approx(12.0, rel=0.03)


def test_both_faces_of_a_thin_plate_are_surfaces() -> None:
    plate = scan([Box((0.0, 0.0, 0.0), (3.0, 0.01, 2.0))], [(1.5, -5.0, 1.0), (1.5, 5.0, 1.0)])
    found = extract(plate).surfaces
    assert sorted(round(s.plane.normal[1]) for s in found) == [-1, 1]


def test_a_cable_scanned_with_few_points_is_kept() -> None:
    wall = scan([Box((-4.0, 8.0, 0.0), (4.0, 8.3, 5.0))], [(0.0, 0.0, 1.5)])
    rng = np.random.default_rng(0)
    along = np.linspace(0.0, 1.0, 60)[:, None]
    cable = (1 - along) * [-3.0, 4.0, 3.0] + along * [3.0, 4.0, 3.2] + rng.normal(0, 0.008, (60, 3))
    views = unit(np.array([0.0, 0.0, 1.5]) - cable)
    both = Cloud(
        np.concatenate([wall.points, cable]),
        np.concatenate([wall.normals, views]),
        np.concatenate([wall.views, views]),
    )
    found = extract(both)
    assert [s.name for s in found.surfaces] == ["wall-south-01"]
    assert len(found.obstacles) == 1
    assert found.obstacles[0].points >= 55
    assert found.obstacles[0].min_m == pytest.approx([-3.0, 4.0, 3.0], abs=0.2)
    assert found.obstacles[0].max_m == pytest.approx([3.0, 4.0, 3.2], abs=0.2)


def test_a_cloud_without_flat_surface_is_refused_by_name() -> None:
    points = np.random.default_rng(0).normal(size=(3000, 3))
    with pytest.raises(BadInput, match=r"bush: no flat surface of at least 0.5 m² .*min_area_m2"):
        extract_structure(
            Cloud(points, unit(points), unit(points)), SurfaceSettings(), "bush", lambda f: None
        )


def test_progress_rises_to_one() -> None:
    said: list[float] = []
    wall = scan([Box((0.0, 5.0, 0.0), (4.0, 5.3, 3.0))], [(2.0, 0.0, 1.5)], step_deg=1.0)
    extract_structure(wall, SurfaceSettings(), "wall", said.append)
    assert said == sorted(said)
    assert said[-1] == 1.0
