"""Rows of `make bench-stitching ARGS="--large COLUMNS ROWS"`: memory of hundreds of photos of 12 MP. They are
simulated at 2 MP and enlarged, with fresh noise: what they look like is not asked here. With --gsd the mosaic
is as fine as that, in mm a pixel: `--large 19 8 --gsd 0.132` writes 100,000 × 40,000 px."""

import resource
import time
from collections.abc import Iterator
from multiprocessing import get_context
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import cv2
import numpy as np

from artifacts import store
from schemas.camera import Camera, CameraPose
from schemas.settings import StitchSettings
from schemas.surface import Surface
from tasks.photos.task import features, ingest
from tasks.stitching.task import stitch
from tests.benchmarks.table import Row, row
from tests.benchmarks.wall_photos import CASES, FOCAL, WallPhotos, wall_photos

SIZE_PX = (4000, 3000)
NOISE = 3.0  # grey levels: detail of the enlarged photos' own


def rows(columns: int, rows_: int, cache: Path, gsd_mm_px: float | None) -> Iterator[Row]:
    (plane,) = (case for case in CASES if case.name == "plane")
    photos = wall_photos(plane, columns, rows_, 2.0, 1, cache)
    with TemporaryDirectory() as folder:
        _enlarge(photos, Path(folder))
        surface = photos.face.surface()
        known_photos = (Path(folder), photos.poses, photos.position_sigma_m, surface, gsd_mm_px)
        with get_context("spawn").Pool(1) as alone:  # the simulator's memory is not asked
            solved, canvas_px, cpu_s, gib = alone.apply(_stitched, known_photos)
    megapixels = canvas_px[0] * canvas_px[1] / 1e6
    data = f"{len(photos.poses)} × 12 MP, canvas {canvas_px[0]:,} × {canvas_px[1]:,} px"
    known: dict[str, Any] = {"data": data, "seed": "1"}
    yield row("large: peak memory", gib, "GiB", "≤ 4", **known)
    yield row("large: photos solved", solved, "photos", f"≥ {len(photos.poses)}", **known)
    yield row("large: canvas", megapixels, "MP", None, **known)
    yield row("large: CPU time", cpu_s, "s", None, **known)


def _enlarge(photos: WallPhotos, folder: Path) -> None:
    rng = np.random.default_rng(0)
    for name in photos.poses:
        small = cv2.imread(str(photos.folder / name))
        assert small is not None
        large = cv2.resize(small, SIZE_PX, interpolation=cv2.INTER_CUBIC)
        noise = rng.normal(0.0, NOISE, large.shape[:2]).astype(np.float32)[..., None]
        noisy = np.clip(np.rint(large + noise), 0, 255).astype(np.uint8)
        cv2.imwrite(str(folder / name), noisy)


def _stitched(
    folder: Path, poses: dict[str, CameraPose], sigma_m: float, surface: Surface, gsd_mm_px: float | None
) -> tuple[int, tuple[int, int], float, float]:
    """Photos solved, size of the canvas, CPU seconds and the largest memory in GiB of this process."""
    began = time.process_time()
    camera = Camera(width_px=SIZE_PX[0], height_px=SIZE_PX[1], focal_px=FOCAL * SIZE_PX[0], k1=-0.02)
    with store.temporary():
        taken = tuple(
            ingest.bare(store.current().put(folder / name), name, "wall", camera, pose, sigma_m)
            for name, pose in sorted(poses.items())
        )
        settings = StitchSettings(gsd_mm_px=gsd_mm_px)
        described = tuple(features.bare(photo, settings) for photo in taken)
        mosaic = stitch.bare("wall", surface, taken, described, settings)
    solved = sum(placement.status == "solved" for placement in mosaic.placements)
    gib = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
    return solved, (mosaic.width_px, mosaic.height_px), time.process_time() - began, gib
