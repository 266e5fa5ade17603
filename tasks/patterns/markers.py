"""Stitching markers of any saturated colour, found by their own peak and not by a fixed pink.

In the plane of colour (CIELAB a, b) the surface makes the highest peak, wherever it lies: wood is no grey.
A marker makes a peak of its own, far from the surface's and saturated; a pixel is the marker's where it is
nearer to that peak than to the surface's. Only compact patches count, so that a rust run or moss stays in
the inspection; what is taken out is grown by a margin and counted.
"""

from typing import NamedTuple

import cv2
import numpy as np
import numpy.typing as npt

from schemas.bit_mask import BitMask
from schemas.raster import Pixels
from tasks.connected import regions

BIN = 4  # Lab units of a cell of the colour histogram
APART = 25.0  # least distance of a marker's peak from the surface's, Lab units: another colour to anyone
SATURATED = 30.0  # least distance of a marker's peak from grey
SPREAD = 30.0  # a marker's pixels lie within this distance of its peak
DARKEST = 25  # of 255, L: colours of darker pixels are noise
LEAST_SHARE = 2e-4  # of the pixels, within a cell of the peak: fewer are no marker peak
LEAST_PX = 100  # area of a marker
LARGEST_SHARE = 0.05  # of the image: what is larger is no marker but a wall painted in two colours
SOLID = 0.75  # least share of its convex hull that a marker fills; a runlet or a letter fills less

Colours = npt.NDArray[np.int64]  # (64, 64) pixels by a, b
Mask = npt.NDArray[np.bool_]


class ColourPeaks(NamedTuple):
    surface: npt.NDArray[np.float64]  # (2,) a, b, 128 is grey
    markers: npt.NDArray[np.float64]  # (M, 2)


def lab_of(rgb: Pixels) -> Pixels:
    """(H, W, 3) 8-bit CIELAB, lightly smoothed: a JPEG's colour noise is no colour."""
    lab = cv2.cvtColor(np.ascontiguousarray(rgb), cv2.COLOR_RGB2LAB)
    return np.asarray(cv2.blur(lab, (3, 3)), dtype=np.uint8)


def colour_histogram(lab: Pixels, valid: Mask) -> Colours:
    """(64, 64) counts by (a, b) of valid pixels that are bright enough to have a colour."""
    a, b = (lab[..., n][valid & (lab[..., 0] >= DARKEST)].astype(np.intp) // BIN for n in (1, 2))
    return np.bincount(a * 64 + b, minlength=64 * 64).reshape(64, 64)


def colour_peaks(histogram: Colours) -> ColourPeaks:
    """The surface's colour and those of markers; no marker where there is no such peak."""
    heights = cv2.GaussianBlur(histogram.astype(np.float64), (0, 0), 1.0)
    surface = _centre(np.array(np.unravel_index(int(heights.argmax()), heights.shape)))
    top = heights >= cv2.dilate(heights, np.ones((7, 7), np.uint8))
    top &= cv2.boxFilter(histogram.astype(np.float64), -1, (3, 3), normalize=False) >= max(
        1.0, LEAST_SHARE * histogram.sum()
    )
    found = _centre(np.argwhere(top))
    from_surface = np.hypot(*(found - surface).T)
    from_grey = np.hypot(*(found - 128.0).T)
    return ColourPeaks(surface, found[(from_surface >= APART) & (from_grey >= SATURATED)])


def marker_pixels(lab: Pixels, peaks: ColourPeaks) -> Mask:
    """(H, W): pixels of a marker's colour."""
    colour = lab[..., 1:].astype(np.float32)
    bright = lab[..., 0] >= DARKEST
    to_surface = np.hypot(*np.moveaxis(colour - peaks.surface.astype(np.float32), -1, 0))
    mask = np.zeros(lab.shape[:2], dtype=bool)
    for marker in peaks.markers:
        to_marker = np.hypot(*np.moveaxis(colour - marker.astype(np.float32), -1, 0))
        mask |= bright & (to_marker < SPREAD) & (to_marker < to_surface)
    return mask


def compact_patches(mask: BitMask, margin_px: int) -> BitMask:
    """The patches of `mask` that are large and compact enough for a marker, grown by the margin."""
    found = regions(mask)
    largest = max(LEAST_PX, LARGEST_SHARE * mask.height_px * mask.width_px)
    chosen = (found.area_px >= LEAST_PX) & (found.area_px <= largest)
    chosen[0] = False
    kept = BitMask(mask.height_px, mask.width_px)
    reach = 2 * margin_px + 1
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (reach, reach))
    for y, x in found.pixels(chosen):
        top, left = int(y.min()) - margin_px, int(x.min()) - margin_px
        patch = np.zeros((int(y.max()) - top + margin_px + 1, int(x.max()) - left + margin_px + 1), np.uint8)
        patch[y - top, x - left] = 1
        outline, _ = cv2.findContours(patch, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
        hull = cv2.convexHull(np.concatenate(outline))
        filled = cv2.fillConvexPoly(np.zeros_like(patch), hull, 1)
        cv2.drawContours(patch, outline, -1, 1, cv2.FILLED)  # a drawing within the marker belongs to it
        if patch.sum() >= SOLID * filled.sum():
            v, u = np.nonzero(cv2.dilate(patch, disc))
            kept.set(v + top, u + left)
    return kept


def _centre(cell: npt.NDArray[np.intp]) -> npt.NDArray[np.float64]:
    return np.asarray(cell * BIN + (BIN - 1) / 2, dtype=np.float64)
