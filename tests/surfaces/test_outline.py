"""Outlines of sampled shapes against the shapes."""

import numpy as np
import pytest
import shapely
from shapely import box

from tasks.surfaces.outline import Part, outline_parts
from tasks.surfaces.voxels import thin

PLATE = box(0, 0, 12.0, 0.9)
L_SHAPE = box(0, 0, 4, 4).difference(box(2, 2, 4, 4))
WITH_HOLE = box(0, 0, 4, 3).difference(box(1.2, 1.0, 2.4, 1.9))


def sample(
    shape: shapely.Geometry, per_m2: int, seed: int = 0, turn: float = 0.3
) -> tuple[np.ndarray, shapely.Geometry]:
    """Random samples with 3 mm noise, at most one per 2 cm voxel, of the shape turned by `turn` radians."""
    rng = np.random.default_rng(seed)
    low, high = np.array(shape.bounds[:2]), np.array(shape.bounds[2:])
    uv = rng.uniform(low, high, (int(per_m2 * np.prod(high - low)), 2))
    uv = uv[shapely.contains_xy(shape, *uv.T)]
    rotation = np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
    uv = uv @ rotation + rng.normal(0, 0.003, uv.shape)
    flat = thin(np.column_stack([uv, np.zeros(len(uv))]), 0.02)
    return flat[:, :2], shapely.transform(shape, lambda ring: ring @ rotation)


def parts(uv: np.ndarray, narrowest_m: float = 0.08) -> list[Part]:
    return outline_parts(uv, 0.05, 0.35, narrowest_m, 0.5)


@pytest.mark.parametrize("shape", [PLATE, L_SHAPE, WITH_HOLE], ids=["plate", "L", "hole"])
@pytest.mark.parametrize("per_m2", [400, 2500, 20_000])
def test_area_within_3_percent_and_outline_within_two_gaps(shape: shapely.Geometry, per_m2: int) -> None:
    uv, truth = sample(shape, per_m2)
    (part,) = parts(uv)
    spacing_m = max(0.02, per_m2**-0.5)
    assert part.polygon.area == pytest.approx(truth.area, rel=0.03)
    assert part.polygon.intersection(truth).area / part.polygon.union(truth).area > 0.94
    assert part.polygon.hausdorff_distance(truth) < 0.05 + 3 * spacing_m
    assert len(part.polygon.interiors) == len(truth.interiors)
    assert part.members.mean() > 0.99
    assert part.polygon.exterior.is_ccw


def test_coplanar_pieces_with_a_girder_between_are_two() -> None:
    uv, _ = sample(shapely.union(box(0, 0, 8, 1.6), box(0, 2.0, 8, 3.6)), 1500)
    found = parts(uv)
    assert len(found) == 2
    assert [p.polygon.area for p in found] == pytest.approx([12.8, 12.8], rel=0.03)
    assert not (found[0].members & found[1].members).any()


def test_density_may_change_along_a_surface() -> None:
    near, _ = sample(box(0, 0, 4, 2), 10_000, turn=0.0)
    far, _ = sample(box(4, 0, 8, 2), 100, turn=0.0)
    (part,) = parts(np.concatenate([near, far]))
    assert part.polygon.area == pytest.approx(16.0, rel=0.05)


def test_whiskers_are_cut_off() -> None:
    uv, _ = sample(shapely.union(box(0, 0, 2, 2), box(2, 1.0, 5, 1.04)), 5000, turn=0.0)
    (part,) = parts(uv)
    assert part.polygon.area == pytest.approx(4.0, rel=0.03)
    assert part.polygon.bounds[2] < 2.2


def test_what_is_too_small_is_no_part() -> None:
    uv, _ = sample(box(0, 0, 0.6, 0.6), 5000)
    assert parts(uv) == []
