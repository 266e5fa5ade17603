"""Method `paper`, end to end as printed: pattern removal (eq. 3, 4), line-like objects, Sauvola (eq. 5 to 7).

Faithful also where that costs: masked pixels become β = 255 and so enter the mean and deviation around them.
"""

import numpy as np
import numpy.typing as npt

from schemas.detection import Peaks
from schemas.raster import Progress, Raster
from tasks.detection.bands import by_bands
from tasks.detection.global_threshold import darker_peak
from tasks.detection.line_like import compact_objects
from tasks.detection.sauvola import Mask, grey_of, sauvola

BETA = 255  # paper, eq. 4


def paper_mask(
    raster: Raster, peaks: Peaks, window_px: int, k: float, R: float, on_progress: Progress | None = None
) -> Mask:
    """(H, W) crack pixels of the whole image by the paper's method."""
    shape = (raster.height_px, raster.width_px)
    compact = np.zeros(shape, dtype=bool)
    darker = darker_peak(peaks)
    if darker is not None and peaks.i_surface is not None:
        compact = compact_objects(_darker_than(raster, (darker + peaks.i_surface) / 2), window_px)

    mask = np.zeros(shape, dtype=bool)

    def band(y0: int, y1: int, top: int, bottom: int) -> None:
        rgb = raster.rgb(top, bottom, 0, raster.width_px)
        valid = raster.valid(top, bottom, 0, raster.width_px)
        grey, red = grey_of(rgb), rgb[..., 0]
        if peaks.i_surface is not None:
            grey[compact[top:bottom]] = peaks.i_surface
        grey[~valid | outside(red, peaks.t1, peaks.t2)] = BETA
        mask[y0:y1] = sauvola(grey, window_px, k, R)[y0 - top : y1 - top]

    by_bands(raster.height_px, window_px, band, on_progress)
    return mask


def outside(red: npt.NDArray[np.uint8], t1: float | None, t2: float | None) -> Mask:
    """Eq. 4: where the red channel lies outside [t1, t2]; a threshold that is not known cuts nothing."""
    low = np.zeros(red.shape, dtype=bool) if t1 is None else red < t1
    high = np.zeros(red.shape, dtype=bool) if t2 is None else red > t2
    return np.asarray(low | high)


def _darker_than(raster: Raster, threshold: float) -> Mask:
    dark = np.zeros((raster.height_px, raster.width_px), dtype=bool)

    def band(y0: int, y1: int, _top: int, _bottom: int) -> None:
        red = raster.rgb(y0, y1, 0, raster.width_px)[..., 0]
        dark[y0:y1] = (red < threshold) & raster.valid(y0, y1, 0, raster.width_px)

    by_bands(raster.height_px, 0, band)
    return dark
