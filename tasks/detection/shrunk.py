"""An image at 1 / 2^octave of its size, what is not known of it filled; read as rarely as memory allows."""

import cv2
import numpy as np

from schemas.raster import Pixels, Raster
from tasks.detection.sauvola import Mask
from tasks.detection.windows import Window

KEPT_PX = 50_000_000  # of a smaller size, kept for those that are smaller still
BAND_PX = 4 << 20  # of an image that are read and shrunk at once, unless it is wider than that
LEAST_ROWS, STEP_ROWS = 128, 32  # of such a band: all but the last are multiples of STEP_ROWS
FILL_PX = 63  # what is not known is filled from this far around


class Shrunk:
    """Windows of it. They begin at multiples of 2^octave, and end at such or with the image. The first one
    asked for is kept, as far as memory allows, for what lies inside it and is asked for at larger sizes."""

    def __init__(self, raster: Raster) -> None:
        self.raster = raster
        self._kept: tuple[Window, int, Pixels] | None = None  # where, at which octave, and its pixels

    def at(self, window: Window, octave: int) -> Pixels:
        """(H, W, 3) of a window."""
        if self._kept is None or window.grown(0, self._kept[0]) != window:
            self._keep(window, octave)
        if self._kept is None or octave < self._kept[1]:
            return self._read(window, octave)
        whole, kept, pixels = self._kept
        top, left = (window.top - whole.top) >> kept, (window.left - whole.left) >> kept
        bottom, right = -((whole.top - window.bottom) >> kept), -((whole.left - window.right) >> kept)
        return _halved(pixels[top:bottom, left:right], octave - kept)

    def _keep(self, window: Window, octave: int) -> None:
        self._kept, finest = None, 1
        while window.area_px >> 2 * finest > KEPT_PX:
            finest += 1
        if finest <= octave:
            self._kept = window, finest, self._read(window, finest)

    def _read(self, window: Window, octave: int) -> Pixels:
        """Band by band."""
        height, width = (-(-side >> octave) for side in _sides(window))
        rows = max(LEAST_ROWS, BAND_PX // _sides(window)[1] // STEP_ROWS * STEP_ROWS)
        shrunk = np.empty((height, width, 3), np.uint8)
        for top in range(window.top, window.bottom, rows):
            band = window._replace(top=top, bottom=min(window.bottom, top + rows))
            part = _halved(_known(self.raster, band, window), octave)
            start = (top - window.top) >> octave
            shrunk[start : start + len(part)] = part
        return shrunk


def _sides(window: Window) -> tuple[int, int]:
    return window.bottom - window.top, window.right - window.left


def _halved(rgb: Pixels, times: int) -> Pixels:
    """Half by half, which is quicker than at once; mirrored up to a whole pixel."""
    down, right = -rgb.shape[0] % (1 << times), -rgb.shape[1] % (1 << times)
    if down or right:
        rgb = np.asarray(cv2.copyMakeBorder(rgb, 0, down, 0, right, cv2.BORDER_REFLECT_101), np.uint8)
    for _ in range(times):
        size = rgb.shape[1] // 2, rgb.shape[0] // 2
        rgb = np.asarray(cv2.resize(rgb, size, interpolation=cv2.INTER_AREA), np.uint8)
    return rgb


def _known(raster: Raster, band: Window, within: Window) -> Pixels:
    """(H, W, 3) of a band, what is unknown filled from the rows around it."""
    if raster.valid(*band).all():
        return raster.rgb(*band)
    top, bottom = max(within.top, band.top - FILL_PX), min(within.bottom, band.bottom + FILL_PX)
    seen = band._replace(top=top, bottom=bottom)
    return filled(raster.rgb(*seen), raster.valid(*seen))[band.inside(seen)]


def filled(rgb: Pixels, valid: Mask) -> Pixels:
    """(H, W, 3): what is not valid takes the mean of what is around it: its rim looks like nothing."""
    if valid.all():
        return rgb
    if not valid.any():
        return np.full_like(rgb, 128)
    mask, size = valid.astype(np.uint8), (FILL_PX, FILL_PX)
    known, sums = (
        np.asarray(cv2.boxFilter(of, cv2.CV_32F, size, normalize=False, borderType=cv2.BORDER_CONSTANT))
        for of in (mask, cv2.copyTo(rgb, mask))
    )
    near = sums / np.maximum(known, np.float32(1.0))[..., None]
    near[known < 0.5] = cv2.mean(rgb, mask)[:3]
    return np.asarray(cv2.copyTo(rgb, mask, np.rint(near).astype(np.uint8)), np.uint8)
