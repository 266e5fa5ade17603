"""A small real inspection: photos of a grey wall with a crack each, that stand for themselves."""

from pathlib import Path

import cv2
import numpy as np


def photograph_crack(path: Path, seed: int, width_px: float = 5.0) -> None:
    """A 480×360 JPEG: grey mottled wall, one dark wavering crack across it."""
    rng = np.random.default_rng(seed)
    wall = 150 + 8 * cv2.GaussianBlur(rng.standard_normal((360, 480)), (0, 0), 6) * 6
    wall += rng.normal(0, 2, wall.shape)
    x = np.arange(480)
    y = 180 + 20 * np.sin(x / 60 + seed) + np.cumsum(rng.normal(0, 0.4, 480))
    distance = np.abs(np.arange(360)[:, None] - y[None, :])
    inside = np.clip(width_px / 2 + 0.5 - distance, 0, 1) * ((x > 40) & (x < 440))
    grey = np.clip(wall * (1 - 0.65 * inside), 0, 255)
    cv2.imwrite(
        str(path), cv2.GaussianBlur(grey, (0, 0), 0.7).astype(np.uint8), [cv2.IMWRITE_JPEG_QUALITY, 95]
    )


def write_inspection(folder: Path, photos: int = 3) -> Path:
    """FOLDER/inspection.yaml over FOLDER/photos/wall-1.jpg …, at 0.5 mm/px."""
    (folder / "photos").mkdir(parents=True)
    for number in range(1, photos + 1):
        photograph_crack(folder / "photos" / f"wall-{number}.jpg", seed=number)
    path = folder / "inspection.yaml"
    path.write_text("name: small\nphotos:\n  - {folder: photos, stitch: false, gsd_mm_px: 0.5}\n")
    return path
