"""How a surface stands out of its plane, as a picture for the dashboard."""

import cv2
import numpy as np
import numpy.typing as npt

from artifacts import store
from artifacts.page import Page, page_key
from artifacts.picture import markdown_of
from schemas.raster import Pixels
from schemas.relief import Relief

DRAWN_PX = 900  # of a picture's longer side


def relief_page(relief: Relief) -> Page:
    """Its colours from the lowest to the highest tenth."""
    picture, low_m, high_m = _drawn(np.load(store.current().path(relief.heights)))
    known = f"{1000 * relief.rms_m:.1f} mm RMS off its plane, known to {1000 * relief.sigma_m:.1f} mm"
    colours = f"Dark {1000 * low_m:+.1f} mm, bright {1000 * high_m:+.1f} mm, measured by {relief.measured_by}"
    title = f"### Relief of {relief.surface}: {known}\n\n{colours}"
    drawn = markdown_of(picture, f"heights of {relief.surface} over its plane")
    key = page_key(f"relief-by-{relief.measured_by}", relief.surface)  # a surface may have one of each
    return Page(key=key, markdown=f"{title}\n\n{drawn}")


def _drawn(w_m: npt.NDArray[np.float32]) -> tuple[Pixels, float, float]:
    """(H, W, 3) RGB of heights, v up; and those of its darkest and its brightest colour, metres."""
    low, high = (float(x) for x in np.percentile(w_m, [10, 90]))
    share = np.clip((w_m - low) / max(high - low, 1e-9), 0, 1)[::-1]
    size = DRAWN_PX / max(w_m.shape)
    coloured = cv2.applyColorMap(np.asarray(255 * share, np.uint8), cv2.COLORMAP_VIRIDIS)
    shape = [max(1, round(size * n)) for n in w_m.shape[::-1]]
    way = cv2.INTER_NEAREST if size > 1 else cv2.INTER_AREA
    return np.ascontiguousarray(cv2.resize(coloured, shape, interpolation=way)[..., ::-1]), low, high
