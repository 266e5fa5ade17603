"""Rows of `make bench-stitching ARGS=--beach`: real drone photos at full size, over ground with trees. There
is no truth; what can be said is whether every photo has a place, how well the places agree, and whether the
mosaic is as sharp as the photos that it is made of."""

import time
from collections.abc import Iterator
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt
import tifffile
from PIL import Image

from artifacts import store
from schemas.mosaic import Mosaic
from schemas.settings import StitchSettings
from tasks.photos.task import features, ingest
from tasks.stitching.task import stitch
from tasks.stitching.undistortion import undistorted_tile
from tests.benchmarks.table import Row, row
from tests.development_data import ROOT

DATA = "real brighton_beach, 18 × 9 MP"
POSITION_SIGMA_M = 5.0
CELL_PX = 128

Array = npt.NDArray[np.float64]


def rows() -> Iterator[Row]:
    folder = ROOT / "photos/brighton_beach"
    if not folder.is_dir():
        yield row("beach", None, "", None, "not on this machine", None)
        return
    began = time.process_time()
    with store.temporary():
        photos = [
            ingest.bare(store.current().put(path), path.name, "beach", None, None, POSITION_SIGMA_M)
            for path in sorted(folder.glob("*.JPG"))
        ]
        settings = StitchSettings()
        described = tuple(features.bare(photo, settings) for photo in photos)
        mosaic = stitch.bare("beach", None, tuple(photos), described, settings)
        spent_s = time.process_time() - began
        of_best, of_usual = _sharpness(mosaic)
    known: dict[str, Any] = {"data": DATA, "seed": None}
    solved = sum(p.status == "solved" for p in mosaic.placements)
    yield row("beach: photos solved", solved, f"of {len(photos)}", f"≥ {len(photos)}", **known)
    yield row("beach: residual of the matches", mosaic.rms_px, "px RMS", None, **known)
    what = "beach: sharpness of the mosaic"
    yield row(f"{what}, to the usual photo's there, median", np.median(of_usual), "1", "≥ 1", **known)
    yield row(f"{what}, to the sharpest photo's there, median", np.median(of_best), "1", None, **known)
    yield row(f"{what}, to the sharpest photo's there, P05", np.percentile(of_best, 5), "1", None, **known)
    yield row("beach: CPU time", spent_s, "s", None, **known)


def _sharpness(mosaic: Mosaic) -> tuple[Array, Array]:
    """(N,) of cells that several photos show whole: contrast of single pixels in the mosaic to that in the
    sharpest and in the median photo, each laid on the mosaic's grid."""
    shelf = store.current()
    ours = _contrast(tifffile.imread(shelf.path(mosaic.image), level=0))
    seen = np.full((len(mosaic.photos), *ours.shape), np.nan)
    for k, (photo, placement) in enumerate(zip(mosaic.photos, mosaic.placements, strict=True)):
        with Image.open(shelf.path(photo.file)) as image:
            tile = undistorted_tile(np.asarray(image.convert("RGB")), photo.camera)
        size, H = (mosaic.width_px, mosaic.height_px), np.array(placement.H_mosaic_photo)
        laid = cv2.warpPerspective(tile.rgb, H, size, flags=cv2.INTER_CUBIC)
        whole = cv2.warpPerspective(tile.coverage, H, size, flags=cv2.INTER_NEAREST)
        full = _means((whole == 255).astype(np.float32)) == 1.0
        seen[k] = np.where(full, _contrast(np.asarray(laid, np.uint8)), np.nan)
    several = np.isfinite(seen).sum(axis=0) >= 2
    seen, ours = seen[:, several], ours[several]
    return ours / np.nanmax(seen, axis=0), ours / np.nanmedian(seen, axis=0)


def _contrast(rgb: npt.NDArray[np.uint8]) -> Array:
    """(rows, columns) of cells: RMS of the Laplacian over the mean brightness, so that gains do not count."""
    grey = cv2.cvtColor(rgb, cv2.COLOR_RGB2GRAY).astype(np.float32)
    edges = cv2.Laplacian(grey, cv2.CV_32F)
    return np.asarray(np.sqrt(_means(edges * edges)) / np.maximum(_means(grey), 1.0))


def _means(values: npt.NDArray[np.float32]) -> Array:
    rows, columns = (n // CELL_PX for n in values.shape)
    cut = values[: rows * CELL_PX, : columns * CELL_PX].reshape(rows, CELL_PX, columns, CELL_PX)
    return np.asarray(cut.mean(axis=(1, 3), dtype=np.float64))
