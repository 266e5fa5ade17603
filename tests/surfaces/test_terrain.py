import numpy as np
import numpy.typing as npt

from tasks.surfaces.cloud import Cloud
from tasks.surfaces.terrain import find_terrain

Floats = npt.NDArray[np.float64]
RNG = np.random.default_rng(0)


def seen_from_above(points: Floats) -> Cloud:
    up = np.tile([0.0, 0.0, 1.0], (len(points), 1))
    return Cloud(points, up, up)


def level(x: tuple[float, float], y: tuple[float, float], z: float, per_m2: int = 60) -> Floats:
    count = int(per_m2 * (x[1] - x[0]) * (y[1] - y[0]))
    return RNG.uniform([x[0], y[0], z], [x[1], y[1], z], (count, 3))


def rolling(points: Floats) -> Floats:
    """Hills of 1 m over 40 m, bumps of 4 cm."""
    x, y = points[:, 0], points[:, 1]
    bumps = 0.04 * np.sin(5 * x) * np.sin(4 * y)
    return points + np.column_stack([0 * x, 0 * x, 0.5 * np.sin(x / 6) + 0.5 * np.cos(y / 7) + bumps])


def test_rolling_rough_ground_is_one_piece_and_what_stands_on_it_is_not() -> None:
    ground = rolling(level((0, 40), (0, 40), 0.0))
    crate = level((20, 22), (20, 22), 3.0, 400)
    terrain = find_terrain(seen_from_above(np.concatenate([ground, crate])), 0.5)
    (piece,) = terrain.pieces
    assert (piece < len(ground)).all()
    assert len(piece) > 0.97 * len(ground)
    assert terrain.carries(ground).mean() > 0.97
    assert not terrain.carries(crate).any()


def test_a_deck_with_the_river_below_is_no_ground() -> None:
    river, deck = level((0, 40), (0, 40), 0.0), level((10, 30), (15, 25), 7.0)
    (piece,) = find_terrain(seen_from_above(np.concatenate([river, deck])), 0.5).pieces
    assert (piece < len(river)).all()


def test_a_roof_scanned_from_the_air_is_no_ground() -> None:
    street = level((0, 60), (0, 60), 0.0)
    street = street[(np.abs(street[:, :2] - 30) > 12).any(axis=1)]  # nothing is seen under the roof
    roof = level((18, 42), (18, 42), 6.0)
    (piece,) = find_terrain(seen_from_above(np.concatenate([street, roof])), 0.5).pieces
    assert (piece < len(street)).all()


def test_a_ceiling_is_no_ground() -> None:
    ceiling = seen_from_above(level((0, 10), (0, 10), 3.0))
    terrain = find_terrain(Cloud(ceiling.points, ceiling.normals, -ceiling.views), 0.5)
    assert terrain.pieces == []
    assert not terrain.carries(ceiling.points).any()


def test_thinly_scanned_ground_beyond_is_still_ground() -> None:
    near = level((0, 20), (0, 20), 0.0)
    far = np.array([[25.0, 5.0, 0.1], [28.0, 10.0, -0.2]])
    terrain = find_terrain(seen_from_above(np.concatenate([near, far])), 0.5)
    assert terrain.carries(far).all()
    assert not terrain.carries(far + np.array([0.0, 0.0, 1.5])).any()
