import numpy as np

from schemas.surface import Surface
from tasks.surfaces.ground import is_ground
from tests.surfaces.test_naming import square


def below(surface: Surface, depth_m: float) -> np.ndarray:
    uv = np.random.default_rng(0).uniform(-1.8, 1.8, (500, 2))
    return surface.to_world(uv) - [0.0, 0.0, depth_m]


def test_ground_is_level_seen_from_above_and_lowest() -> None:
    floor = square((0.0, 0.0, 0.0), (0.05, 0.0, 1.0))
    assert is_ground([floor], below(floor, 0.0)) == [True]
    assert is_ground([floor], below(floor, 0.15)) == [True]  # a kerb
    assert is_ground([floor], np.concatenate([below(floor, 0.0), below(floor, 0.7)])) == [False]  # a table
    assert is_ground([square((0, 0, 0), (0, 0, -1))], below(floor, 0.0)) == [False]
    assert is_ground([square((0, 0, 0), (0, -1, 0))], below(floor, 0.0)) == [False]
