import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from schemas.plane import Plane
from schemas.surface import Surface, in_plane_axes
from tasks.surfaces.cloud import unit
from tasks.surfaces.naming import name_surfaces


def square(middle: tuple[float, float, float], normal: tuple[float, float, float]) -> Surface:
    n = unit(np.array([normal]))[0]
    u, v = in_plane_axes(n)
    ring = ((-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0))
    plane = Plane.through(middle, n)
    return Surface(name="", plane=plane, origin_m=middle, u=u, v=v, outline_m=ring, hull_m=ring, area_m2=4.0)


def test_a_surface_is_called_by_the_way_it_faces() -> None:
    normals = [(0, -1, 0), (0, 0.3, 1), (0, 0, -1), (0, 0, 1), (1, 0, 1), (-1, 1, 0.4)]
    surfaces = [square((10.0 * k, 0.0, 0.0), n) for k, n in enumerate(normals)]
    found = {s.origin_m[0] / 10: s.name for s in name_surfaces(surfaces, [k == 3 for k in range(6)])}
    assert found == {
        0: "wall-south-01",
        1: "top-01",
        2: "soffit-01",
        3: "ground-01",
        4: "slope-east-01",
        5: "wall-northwest-01",
    }


@settings(deadline=None, max_examples=50)
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
    named = name_surfaces(shuffled, [False] * 12)
    assert [s.name for s in named] == [f"wall-south-{k:02d}" for k in range(1, 13)]
    for place, surface in zip(places, named, strict=True):
        np.testing.assert_allclose(surface.origin_m, place, atol=0.51)


def test_soffits_are_numbered_from_the_highest_level_down() -> None:
    soffits = [square((0.0, 0.0, z), (0, 0, -1)) for z in (5.7, 7.4, 6.5)]
    assert [s.origin_m[2] for s in name_surfaces(soffits, [False] * 3)] == [7.4, 6.5, 5.7]


def test_nothing_to_name() -> None:
    assert name_surfaces([], []) == ()
