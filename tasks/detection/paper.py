"""Method `paper`, end to end as printed: pattern removal (eq. 3, 4), line-like objects, Sauvola (eq. 5 to 7).

Faithful also where that costs: masked pixels become β = 255 and so enter the mean and deviation around them.
"""

import numpy as np
import numpy.typing as npt

from schemas.bit_mask import BitMask
from schemas.detection import Peaks
from schemas.raster import Progress, Raster
from tasks.detection.global_threshold import darker_peak
from tasks.detection.line_like import compact_objects
from tasks.detection.sauvola import Mask, grey_of, sauvola
from tasks.detection.windows import Window, by_windows

BETA = 255  # paper, eq. 4


def paper_mask(
    raster: Raster, peaks: Peaks, window_px: int, k: float, R: float, on_progress: Progress | None = None
) -> BitMask:
    """Crack pixels of the whole image by the paper's method."""
    mask = BitMask(raster.height_px, raster.width_px)
    darker = darker_peak(peaks)
    surface = None if darker is None else peaks.i_surface

    def fill(window: Window, seen: Window) -> None:
        rgb, valid = raster.rgb(*seen), raster.valid(*seen)
        grey, red = grey_of(rgb), rgb[..., 0]
        if darker is not None and surface is not None:
            dark = (red < (darker + surface) / 2) & valid
            grey[compact_objects(dark, window_px)] = surface
        grey[~valid | outside(red, peaks.t1, peaks.t2)] = BETA
        mask.write(window.top, window.left, sauvola(grey, window_px, k, R)[window.inside(seen)])

    # as far as Sauvola's window, and an object that is smaller than it lies within as much again
    by_windows(raster, 2 * window_px, fill, on_progress)
    return mask


def outside(red: npt.NDArray[np.uint8], t1: float | None, t2: float | None) -> Mask:
    """Eq. 4: where the red channel lies outside [t1, t2]; a threshold that is not known cuts nothing."""
    low = np.zeros(red.shape, dtype=bool) if t1 is None else red < t1
    high = np.zeros(red.shape, dtype=bool) if t2 is None else red > t2
    return np.asarray(low | high)
