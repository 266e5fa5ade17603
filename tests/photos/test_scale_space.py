"""Blobs of known place and size: each is found there, as large as it is, and edges are none."""

import numpy as np
import pytest

from tasks.photos.scale_space import BORDER_PX, LAYERS, Points, _outstanding, extrema, octaves

CONTRAST = 0.002


def blob(x: float, y: float, sigma: float, height: float, side_px: int = 300) -> np.ndarray:
    rows, columns = np.mgrid[:side_px, :side_px]
    return height * np.exp(-((columns - x) ** 2 + (rows - y) ** 2) / (2 * sigma**2))


def found(grey: np.ndarray, enlarged: float = 1.0) -> Points:
    return extrema(octaves(grey.astype(np.float32), enlarged), CONTRAST)


@pytest.mark.parametrize("sigma", [3.0, 7.3, 20.0])
@pytest.mark.parametrize("height", [60.0, -60.0])
def test_a_blob_is_found_where_it_is_and_as_large_as_it_is(sigma: float, height: float) -> None:
    points = found(120 + blob(140.3, 151.7, sigma, height))
    best = int(points.response.argmax())
    assert points.x[best] == pytest.approx(140.3, abs=0.02 * sigma)
    assert points.y[best] == pytest.approx(151.7, abs=0.02 * sigma)
    assert points.sigma[best] == pytest.approx(np.hypot(sigma, 0.5), rel=0.25)  # a DoG answers a little finer


def test_sizes_grow_with_the_blobs() -> None:
    sizes = []
    for sigma in (3.0, 6.0, 12.0, 24.0):
        points = found(120 + blob(150, 150, sigma, 60.0))
        sizes.append(points.sigma[points.response.argmax()])
    assert np.diff(np.log2(sizes)) == pytest.approx(1.0, abs=0.1)


def test_a_brighter_blob_answers_more_and_a_faint_one_not_at_all() -> None:
    answers = [found(120 + blob(150, 150, 5.0, height)).response.max(initial=0.0) for height in (40, 20)]
    assert answers[0] == pytest.approx(2 * answers[1], rel=0.01)
    assert len(found(120 + blob(150, 150, 5.0, 0.3)).x) == 0


def test_edges_and_the_rim_hold_no_points() -> None:
    grey = np.full((300, 300), 60.0)
    grey[:, 150:] = 180.0
    assert len(found(grey).x) == 0
    assert len(found(120 + blob(2.0, 150.0, 1.5, 60.0)).x) == 0


def test_what_no_neighbour_surpasses_is_all_that_is_looked_at() -> None:
    """Beside a plain search of every pixel."""
    rng = np.random.default_rng(0)
    layers = rng.normal(size=(LAYERS + 3, 40, 50)).astype(np.float32)
    away = layers[1:] - layers[:-1]
    expected = set()
    for k in range(1, LAYERS + 1):
        for y in range(BORDER_PX, 40 - BORDER_PX):
            for x in range(BORDER_PX, 50 - BORDER_PX):
                near, value = away[k - 1 : k + 2, y - 1 : y + 2, x - 1 : x + 2], away[k, y, x]
                if abs(value) > 0.5 and value in (near.max(), near.min()):
                    expected.add((k, y, x))
    assert {tuple(map(int, row)) for row in _outstanding(layers, np.float32(0.5))} == expected


@pytest.mark.parametrize("shape", [(1, 1), (8, 300), (300, 2)])
def test_a_picture_too_small_for_any_holds_no_points(shape: tuple[int, int]) -> None:
    rng = np.random.default_rng(0)
    assert len(found(rng.uniform(0, 255, shape)).x) == 0
