"""What of a mosaic can be inspected: covered by a photo, on the surface, not under a marker."""

from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

from schemas.bit_mask import BitMask
from schemas.detection import Peaks
from schemas.raster import Progress, Raster
from schemas.settings import PatternSettings
from tasks.patterns.markers import (
    Mask,
    colour_histogram,
    colour_peaks,
    compact_patches,
    lab_of,
    marker_pixels,
)
from tasks.patterns.thresholds import RedHistograms, paper_thresholds

BAND_ROWS, BAND_PX = 512, 1 << 24  # looked at together, at most
Ring = npt.NDArray[np.float64]  # (N, 2) x, y in pixels


@dataclass(frozen=True)
class PatternArrays:
    masked: BitMask  # True where nothing can be inspected
    blank_px: int
    outside_px: int
    pattern_px: int
    peaks: Peaks


def remove(
    raster: Raster,
    outline: list[Ring] | None,
    settings: PatternSettings,
    on_progress: Progress | None = None,
) -> PatternArrays:
    """outline: the surface's outer ring and then its holes in the image; None: all of it is surface."""
    height, width = raster.height_px, raster.width_px
    colours = np.zeros((64, 64), dtype=np.int64)
    for y0, y1 in _bands(height, width):
        known = raster.valid(y0, y1, 0, width) & inside(outline, y0, y1, width)
        colours += colour_histogram(lab_of(raster.rgb(y0, y1, 0, width)), known)
        if on_progress is not None:
            on_progress(0.5 * y1 / height)
    peaks = colour_peaks(colours)
    markers = BitMask(height, width)
    if settings.remove and len(peaks.markers):
        for y0, y1 in _bands(height, width):
            coloured = marker_pixels(lab_of(raster.rgb(y0, y1, 0, width)), peaks)
            markers.write(y0, 0, coloured & raster.valid(y0, y1, 0, width))
        markers = compact_patches(markers, settings.margin_px)
    masked = BitMask(height, width)
    red_of = RedHistograms(*(np.zeros(256, dtype=np.int64) for _ in range(3)))
    blank_px = outside_px = pattern_px = 0
    for y0, y1 in _bands(height, width):
        red = raster.rgb(y0, y1, 0, width)[..., 0]
        covered, on_surface = raster.valid(y0, y1, 0, width), inside(outline, y0, y1, width)
        marked = markers.read(y0, y1, 0, width) & covered
        surface = covered & on_surface & ~marked
        for counts, where in zip(red_of, (~covered, surface, marked), strict=True):
            counts += np.bincount(red[where], minlength=256)
        masked.write(y0, 0, ~surface)
        blank_px += int((~covered).sum())
        outside_px += int((covered & ~on_surface).sum())
        pattern_px += int((marked & on_surface).sum())
        if on_progress is not None:
            on_progress(0.5 + 0.5 * y1 / height)
    return PatternArrays(masked, blank_px, outside_px, pattern_px, paper_thresholds(red_of))


def inside(outline: list[Ring] | None, top: int, bottom: int, width_px: int) -> Mask:
    """(bottom − top, W), of these rows: pixels within the first ring and outside the others (even–odd
    rule)."""
    shape = (bottom - top, width_px)
    if outline is None:
        return np.ones(shape, dtype=bool)
    rings = [np.rint(ring).astype(np.int32) - np.array([0, top], dtype=np.int32) for ring in outline]
    return np.asarray(cv2.fillPoly(np.zeros(shape, dtype=np.uint8), rings, 1) > 0)


def _bands(height: int, width: int) -> list[tuple[int, int]]:
    rows = max(1, min(BAND_ROWS, BAND_PX // width))
    return [(y, min(height, y + rows)) for y in range(0, height, rows)]
