import numpy as np

from tasks.surfaces.patches import Patch, patches
from tasks.surfaces.structure import of_structure

SOUTH, UP = np.array([0.0, -1.0, 0.0]), np.array([0.0, 0.0, 1.0])
RNG = np.random.default_rng(0)


def made(*boxes: tuple[list[float], list[float], np.ndarray]) -> tuple[list[Patch], np.ndarray]:
    parts = [RNG.uniform(low, high, (4000, 3)) for low, high, _ in boxes]
    points = np.concatenate(parts)
    found: list[Patch] = []
    for number, (_, _, facing) in enumerate(boxes):
        own = np.arange(4000 * number, 4000 * (number + 1))
        found += patches(points, own, facing, 0.08, 0.35, 0.5)
    return found, points


def test_a_car_beside_the_bridge_is_not_of_it_and_a_second_pier_is() -> None:
    found, points = made(
        ([0, 0, 0], [6, 0, 3], SOUTH),
        ([7.5, 0, 0], [9.5, 0, 3], SOUTH),
        ([0, -4, 0], [2, -4, 1], SOUTH),
        ([-5, -8, 0], [12, 3, 0], UP),
    )
    assert of_structure(found, [False, False, False, True], points, 0.5) == [True, True, False, True]


def test_with_nothing_but_ground_all_is_of_it() -> None:
    found, points = made(([0, 0, 0], [4, 4, 0], UP))
    assert of_structure(found, [True], points, 0.5) == [True]
