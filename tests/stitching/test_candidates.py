"""Which pairs are tried: by position where it tells, by look where it does not."""

import numpy as np
import numpy.typing as npt
import pytest

from schemas.camera import Camera
from tasks.stitching.candidates import candidate_pairs
from tasks.stitching.prior import Prior
from tasks.stitching.view import FACING, View

CAMERA = Camera(width_px=1200, height_px=900, focal_px=1000.0)
COLUMNS, ROWS, STEP_M, AWAY_M = 15, 4, 1.0, 2.0


def flown(sigma_m: float) -> tuple[list[Prior], list[npt.NDArray[np.float64]], list[npt.NDArray[np.uint8]]]:
    """60 photos of 2.4 × 1.8 m, a metre apart, of a wall whose points all look different."""
    rng = np.random.default_rng(1)
    points = rng.uniform((-1.5, -1.5), (COLUMNS + 0.5, ROWS + 0.5), (4000, 2))
    look = rng.integers(0, 90, (len(points), 128)).astype(np.uint8)
    priors, scales, descriptors = [], [], []
    for k in range(COLUMNS * ROWS):
        at = np.array([STEP_M * (k % COLUMNS), STEP_M * (k // COLUMNS), AWAY_M])
        inside = (np.abs(points - at[:2]) < [1.2, 0.9]).all(axis=1)
        noisy = look[inside] + rng.integers(0, 4, (int(inside.sum()), 128)).astype(np.uint8)
        said = at + np.append(rng.normal(0, sigma_m, 2), 0.0)
        priors.append(Prior(View(CAMERA, FACING, said), np.full(3, sigma_m), np.radians(np.full(3, 2.0))))
        scales.append(np.full(len(noisy), 3.0))
        descriptors.append(noisy)
    return priors, scales, descriptors


def neighbours() -> set[tuple[int, int]]:
    every = range(COLUMNS * ROWS)
    beside = {(i, i + 1) for i in every if (i + 1) % COLUMNS}
    return beside | {(i, i + COLUMNS) for i in every if i + COLUMNS in every}


@pytest.mark.parametrize("sigma_m", [0.1, 1.5, 5.0])
def test_neighbours_are_tried_however_unsure_their_positions(sigma_m: float) -> None:
    """Of the nearest twelve by positions five metres off, most are no neighbours, and the wall fell apart."""
    pairs = candidate_pairs(*flown(sigma_m))
    assert len(neighbours() - set(pairs)) <= 0.01 * len(neighbours())
    assert len(pairs) <= 24 * COLUMNS * ROWS  # linear in photos
    assert all(i < j for i, j in pairs)


def test_sure_positions_are_not_looked_at() -> None:
    priors, scales, descriptors = flown(0.1)
    nothing = [d[:0] for d in descriptors]
    assert candidate_pairs(priors, [s[:0] for s in scales], nothing) == candidate_pairs(
        priors, scales, descriptors
    )
