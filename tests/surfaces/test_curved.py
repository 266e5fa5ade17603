"""Cylinders, cut into strips; what only looks like one."""

from itertools import pairwise

import numpy as np
import pytest

from tasks.surfaces.cloud import Cloud, unit
from tasks.surfaces.curved import cut_curves
from tasks.surfaces.ransac import Support, find_planes

DISTANCE_M, CELL_M = 0.02, 0.35


def curve(
    x: np.ndarray, y: np.ndarray, height_m: float, seed: int, outward: float = 1.0, noise_m: float = 0.003
) -> Cloud:
    """Points on the upright wall over the curve (x, y), each seen from 5 m before it."""
    rng = np.random.default_rng(seed)
    z = rng.uniform(0, height_m, len(x))
    tangent = np.gradient(np.column_stack([x, y]), axis=0)
    normals = outward * unit(np.column_stack([tangent[:, 1], -tangent[:, 0], np.zeros(len(x))]))
    points = np.column_stack([x, y, z]) + normals * rng.normal(0, noise_m, (len(x), 1))
    order = rng.permutation(len(x))
    return Cloud(points[order], normals[order], normals[order])


def arc(
    radius_m: float, from_deg: float, to_deg: float, count: int = 12_000
) -> tuple[np.ndarray, np.ndarray]:
    turn = np.radians(np.linspace(from_deg, to_deg, count))
    return radius_m * np.cos(turn), radius_m * np.sin(turn)


def cut(cloud: Cloud, seed: int = 0) -> list[Support]:
    planes = find_planes(cloud, DISTANCE_M, CELL_M, 0.3, seed, lambda f: None)
    return cut_curves(planes, cloud, DISTANCE_M, CELL_M)


def facings_deg(strips: list[Support]) -> np.ndarray:
    return np.sort([np.degrees(np.arctan2(s.normal[1], s.normal[0])) % 360 for s in strips])


@pytest.mark.parametrize("outward", [1.0, -1.0])
def test_an_arc_becomes_equal_strips_that_every_point_is_near(outward: float) -> None:
    cloud = curve(*arc(4.0, 20, 160), 3.0, 0, outward)
    strips = cut(cloud)
    turns = np.diff(facings_deg(strips))
    assert turns == pytest.approx(np.full(len(turns), 140 / len(strips)), abs=0.3)
    assert len(np.concatenate([s.points for s in strips])) > 0.99 * len(cloud)
    for strip in strips:
        height = np.abs((cloud.points[strip.points] - strip.centroid) @ strip.normal)
        assert np.quantile(height, 0.95) <= DISTANCE_M
        middle = cloud.points[strip.points].mean(axis=0)[:2]
        assert unit(outward * middle[None])[0] @ strip.normal[:2] > np.cos(np.radians(0.5))


def test_strips_stay_where_they_are_with_other_noise_and_seed() -> None:
    first = facings_deg(cut(curve(*arc(4.0, 20, 160), 3.0, 0)))
    for seed in range(1, 6):
        again = facings_deg(cut(curve(*arc(4.0, 20, 160), 3.0, seed), seed))
        assert again == pytest.approx(first, abs=0.3)


def test_a_round_pier_is_cut_from_north_on() -> None:
    first = facings_deg(cut(curve(*arc(0.45, 0, 360), 3.0, 0)))
    assert np.abs(first - 90).min() < 0.5
    assert np.diff(first) == pytest.approx(np.full(len(first) - 1, 360 / len(first)), abs=0.6)


def test_an_eight_sided_column_keeps_its_sides() -> None:
    corners = np.array([(np.cos(t), np.sin(t)) for t in np.radians(45 * np.arange(9))]) * 0.5
    sides = [np.linspace(a, b, 1500, endpoint=False) for a, b in pairwise(corners)]
    cloud = curve(*np.concatenate(sides).T, 3.0, 0)
    assert len(cut(cloud)) == 8
    assert np.diff(facings_deg(cut(cloud))) == pytest.approx(np.full(7, 45.0), abs=1.0)


def test_planes_that_lie_on_no_circle_are_left_as_they_are() -> None:
    turn = np.linspace(0, np.pi, 12_000)
    cloud = curve(6.0 * np.cos(turn), 2.0 * np.sin(turn), 3.0, 0)
    planes = find_planes(cloud, DISTANCE_M, CELL_M, 0.3, 0, lambda f: None)
    covered = sum(len(s.points) for s in cut_curves(planes, cloud, DISTANCE_M, CELL_M))
    assert covered >= 0.98 * sum(len(s.points) for s in planes)


def test_a_box_has_no_curve() -> None:
    walls = [
        np.linspace((0, 0), (3, 0), 3000),
        np.linspace((3, 0), (3, 2), 2000),
        np.linspace((3, 2), (0, 2), 3000),
    ]
    cloud = curve(*np.concatenate(walls).T, 2.0, 0)
    planes = find_planes(cloud, DISTANCE_M, CELL_M, 0.3, 0, lambda f: None)
    assert cut_curves(planes, cloud, DISTANCE_M, CELL_M) == planes
