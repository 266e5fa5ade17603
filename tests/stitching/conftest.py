"""One wall, photographed once for all tests of this folder."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from artifacts import store
from schemas.camera import Camera
from tests.stitching.photo_sets import PhotoSet, photo_set
from tests.stitching.scenes import Texture, concrete, grid_poses, render, reported

CAMERA = Camera(width_px=816, height_px=612, focal_px=2000.0, k1=-0.05, p1=0.0005)
GAINS = (1.0, 1.15, 0.87, 1.05, 0.92, 1.1, 0.9, 1.0, 1.12, 0.95, 1.08, 0.88)


@pytest.fixture(scope="package", autouse=True)
def own_store() -> Iterator[None]:
    with store.temporary():
        yield


@pytest.fixture(scope="package")
def texture() -> Texture:
    return concrete()


@pytest.fixture(scope="package")
def wall(own_store: None, texture: Texture, tmp_path_factory: pytest.TempPathFactory) -> PhotoSet:
    """4 × 3 photos, 50 % overlap, exposures ±15 %, positions reported within 0.1 m; k1 is not known."""
    true = grid_poses(CAMERA, 4, 3, 4.0, 0.5, seed=3)
    said = reported(true, 0.1, seed=4)
    names = [f"{k:02d}.png" for k in np.random.default_rng(5).permutation(len(true))]  # in no order
    images = {
        name: render(texture, CAMERA, pose, gain, seed=k)
        for k, (name, pose, gain) in enumerate(zip(names, true, GAINS, strict=True))
    }
    nominal = Camera(width_px=816, height_px=612, focal_px=2000.0, p1=0.0005)
    truth = {name: (CAMERA, pose) for name, pose in zip(names, true, strict=True)}
    poses = dict(zip(names, said, strict=True))
    return photo_set(tmp_path_factory.mktemp("wall"), images, nominal, truth, poses)


@pytest.fixture(scope="package")
def true_gains(wall: PhotoSet) -> dict[str, float]:
    """The factor that undoes each photo's exposure, geometric mean 1."""
    undo = {photo.name: 1.0 / gain for photo, gain in zip(wall.photos, GAINS, strict=True)}
    mean = float(np.exp(np.mean(np.log(list(undo.values())))))
    return {name: value / mean for name, value in undo.items()}


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return tmp_path
