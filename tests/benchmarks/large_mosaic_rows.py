"""Rows of `make bench-detection ARGS="--parts size"`: patterns, detection and measurement of a mosaic of more
pixels than OpenCV reads of a PNG, in a process of its own. The mosaic is made as it is read: a wall, mirrored
over and over, here and there with a crack, and one crack from side to side."""

import resource
import time
from collections.abc import Iterator
from functools import cached_property
from multiprocessing import get_context
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.ndimage import gaussian_filter1d

from artifacts.mask_png import read_mask, write_mask
from schemas.bit_mask import BitMask
from schemas.raster import Pixels
from schemas.settings import DetectSettings, PatternSettings
from tasks.detection.detect import detect_raster
from tasks.measurement.measure import measure_cracks
from tasks.patterns.remove import remove
from tests.benchmarks.cracked_walls import SIDE_PX, cracked_wall
from tests.benchmarks.table import Row, row

LARGE_PX = 33_000  # a side: 1.09 Gpx
CRACKED = 0.05  # share of the tiles
WIDTH_PX = 4.0
SLOPE = 0.8  # of the long crack's wander, alike at each scale
LEAST_PX, GAP_PX = 100.0, 40.0
SEED = 700


class Measured(NamedTuple):
    longest_px: float  # from end to end of the longest crack, in columns
    cracks: int
    cpu_s: float
    gib: float


class LargeMosaic:
    """height_px and width_px: LARGE_PX."""

    height_px = width_px = LARGE_PX

    def __init__(self) -> None:
        self.taken_out = BitMask(LARGE_PX, LARGE_PX)
        rng = np.random.default_rng(SEED)
        tiles = -(-LARGE_PX // SIDE_PX)
        self.cracked = rng.random((tiles, tiles)) < CRACKED
        slope = sum(
            gaussian_filter1d(rng.normal(0.0, SLOPE * sigma**0.5, LARGE_PX), sigma) for sigma in (1, 4, 16)
        )
        wander = np.cumsum(np.clip(slope, -3.0, 3.0))
        self.middle_px = np.linspace(0.3, 0.7, LARGE_PX) * LARGE_PX + wander

    @cached_property
    def _tiles(self) -> tuple[Pixels, Pixels]:
        plain, crack = (cracked_wall(SEED, WIDTH_PX, depth).rgb for depth in (0.0, 10.0))
        return plain, crack

    def rgb(self, y0: int, y1: int, x0: int, x1: int) -> Pixels:
        window = np.empty((y1 - y0, x1 - x0, 3), dtype=np.uint8)
        for i in range(y0 // SIDE_PX, -(-y1 // SIDE_PX)):
            for j in range(x0 // SIDE_PX, -(-x1 // SIDE_PX)):
                tile = self._tiles[int(self.cracked[i, j])][:: 1 - 2 * (i % 2), :: 1 - 2 * (j % 2)]
                top, left = i * SIDE_PX, j * SIDE_PX
                a, b, c, d = max(y0, top), min(y1, top + SIDE_PX), max(x0, left), min(x1, left + SIDE_PX)
                window[a - y0 : b - y0, c - x0 : d - x0] = tile[a - top : b - top, c - left : d - left]
        return self._with_the_long_crack(window, y0, x0)

    def _with_the_long_crack(self, window: Pixels, y0: int, x0: int) -> Pixels:
        middle = self.middle_px[x0 : x0 + window.shape[1]] - y0
        a = max(0, int(middle.min()) - 8)
        b = min(len(window), int(middle.max()) + 9)
        if a < b:
            away = np.abs(np.arange(a, b)[:, None] - middle)
            kept = 1.0 - 0.6 * np.clip(WIDTH_PX / 2 + 0.5 - away, 0.0, 1.0)
            window[a:b] = np.rint(window[a:b] * kept[..., None]).astype(np.uint8)
        return window

    def valid(self, y0: int, y1: int, x0: int, x1: int) -> npt.NDArray[np.bool_]:
        return ~self.taken_out.read(y0, y1, x0, x1)


def rows() -> Iterator[Row]:
    with get_context("spawn").Pool(1) as alone:
        found = alone.apply(_measured)
    cracks = int(LargeMosaic().cracked.sum()) + 1
    megapixels = LARGE_PX**2 / 1e6
    data, seed = f"{LARGE_PX:,} × {LARGE_PX:,} px with {cracks} cracks, hairline", f"{SEED}"
    yield row("large mosaic: peak memory", found.gib, "GiB", "≤ 2", data, seed)
    yield row("large mosaic: cracks", found.cracks, "", None, data, seed)
    share = found.longest_px / LARGE_PX
    yield row("large mosaic: found in one piece of the crack from side to side", share, "", None, data, seed)
    yield row("large mosaic: CPU time", 1e3 * found.cpu_s / megapixels, "ms/MP", None, data, seed)


def _measured() -> Measured:
    began, mosaic = time.process_time(), LargeMosaic()
    patterns = remove(mosaic, None, PatternSettings())
    mosaic.taken_out = _by_way_of_a_file(patterns.masked)
    mask = _by_way_of_a_file(detect_raster(mosaic, DetectSettings(), None, patterns.peaks).bits)
    found = measure_cracks(mosaic, mask, LEAST_PX, GAP_PX).cracks
    longest = max((float(np.ptp(crack.centreline[:, 0])) for crack in found), default=0.0)
    gib = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
    return Measured(longest, len(found), time.process_time() - began, gib)


def _by_way_of_a_file(mask: BitMask) -> BitMask:
    with TemporaryDirectory() as folder:
        write_mask(mask, Path(folder) / "mask.png")
        return read_mask(Path(folder) / "mask.png", "mask")
