import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from schemas.plane import Plane
from schemas.surface import Surface, in_plane_axes
from tasks.surfaces.cloud import unit
from tasks.surfaces.naming import _plain_m2, name_surfaces


def square(middle: tuple[float, float, float], normal: tuple[float, float, float]) -> Surface:
    n = unit(np.array([normal]))[0]
    u, v = in_plane_axes(n)
    ring = ((-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0))
    plane = Plane.through(middle, n)
    return Surface(name="", plane=plane, origin_m=middle, u=u, v=v, outline_m=ring, hull_m=ring, area_m2=4.0)


def named(surfaces: list[Surface], ground: list[bool] | None = None) -> tuple[Surface, ...]:
    return name_surfaces(surfaces, ground or [False] * len(surfaces), [True] * len(surfaces), 0.5)


def test_a_surface_is_called_by_the_way_it_faces() -> None:
    normals = [(0, -1, 0), (0, 0.3, 1), (0, 0, -1), (0, 0, 1), (1, 0, 1), (-1, 1, 0.4)]
    surfaces = [square((10.0 * k, 0.0, 0.0), n) for k, n in enumerate(normals)]
    found = {s.origin_m[0] / 10: s.name for s in named(surfaces, [k == 3 for k in range(6)])}
    assert found == {
        0: "wall-south-01",
        1: "top-01",
        2: "soffit-01",
        3: "ground-01",
        4: "slope-east-01",
        5: "wall-northwest-01",
    }


@settings(max_examples=50)
@given(st.integers(0, 2**32 - 1))
def test_order_is_by_place_whatever_the_input_order_and_noise(seed: int) -> None:
    rng = np.random.default_rng(seed)
    places = [(x, y, z) for y in (4.0, 0.2, 0.0) for x in (0.0, 3.0) for z in (0.0, 2.5)]  # back to front
    noise = [
        rng.uniform(-1, 1, 3) * (0.15, 0.02, 0.5) for _ in places
    ]  # shadows move the middle in the plane
    noisy = [
        square(tuple(np.add(p, e)), (0, -1, rng.uniform(-0.002, 0.002)))
        for p, e in zip(places, noise, strict=True)
    ]
    shuffled = [noisy[k] for k in rng.permutation(12)]
    found = named(shuffled)
    assert [s.name for s in found] == [f"wall-south-{k:02d}" for k in range(1, 13)]
    for place, surface in zip(places, found, strict=True):
        np.testing.assert_allclose(surface.origin_m, place, atol=0.51)


def test_soffits_are_numbered_from_the_highest_level_down() -> None:
    soffits = [square((0.0, 0.0, z), (0, 0, -1)) for z in (5.7, 7.4, 6.5)]
    assert [s.origin_m[2] for s in named(soffits)] == [7.4, 6.5, 5.7]


def test_nothing_to_name() -> None:
    assert named([]) == ()


def test_small_pieces_and_cars_that_come_and_go_rename_nothing() -> None:
    walls = [square((0.0, y, 0.0), (0, -1, 0)) for y in (9.0, 6.0, 3.0)]
    scrap = square((0.0, 7.0, 0.0), (0, -1, 0)).model_copy(update={"area_m2": 0.6})
    car = square((0.0, 8.0, 0.0), (0, -1, 0))
    alone = named(walls)
    with_scrap = name_surfaces([scrap, *walls], [False] * 4, [True] * 4, 0.5)
    with_car = name_surfaces([car, *walls], [False] * 4, [False, True, True, True], 0.5)
    assert with_scrap[:3] == with_car[:3] == alone
    assert with_scrap[3].origin_m == scrap.origin_m
    assert with_car[3].origin_m == car.origin_m


@settings(max_examples=50)
@given(st.lists(st.floats(0.5, 100.0), max_size=20))
def test_no_area_lies_near_the_limit_of_small_unless_areas_lie_everywhere(areas: list[float]) -> None:
    limit = _plain_m2(areas, 0.5)
    assert 0.5 <= limit <= max([0.5, *areas])
    ordered = np.sort([0.5, *areas])
    gaps = (ordered[1:] / ordered[:-1])[ordered[:-1] <= 4.0]
    apart = min((max(a / limit, limit / a) for a in areas if a > 0.5), default=np.inf)
    assert apart >= np.sqrt(gaps.max(initial=1.0)) * (1 - 1e-9)
