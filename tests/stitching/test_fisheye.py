"""A wall through a fisheye: the same stage, the same accuracy."""

from pathlib import Path

import numpy as np

from schemas.camera import Camera
from tests.stitching.photo_sets import errors_px, photo_set
from tests.stitching.scenes import WALL, Texture, grid_poses, render, reported

CALIBRATED = {"focal_px": 600.0, "cx_px": 407.5, "cy_px": 305.5, "k1": -0.02, "k2": 0.004}
FISHEYE = Camera(width_px=816, height_px=612, lens="fisheye", **CALIBRATED)


def test_a_wall_through_a_fisheye(texture: Texture, tmp_path: Path) -> None:
    true = grid_poses(FISHEYE, 3, 2, 1.2, 0.6, seed=3)
    said = reported(true, 0.05, seed=4)
    names = [f"{k}.png" for k in range(len(true))]
    images = {
        n: render(texture, FISHEYE, pose, seed=k) for k, (n, pose) in enumerate(zip(names, true, strict=True))
    }
    truth = {n: (FISHEYE, pose) for n, pose in zip(names, true, strict=True)}
    photos = photo_set(tmp_path, images, FISHEYE, truth, dict(zip(names, said, strict=True)), 0.05)
    mosaic = photos.stitch(WALL)
    assert [p.status for p in mosaic.placements] == ["solved"] * 6
    error = errors_px(mosaic, truth, gauge=True)
    assert np.sqrt((error**2).mean()) < 0.15
