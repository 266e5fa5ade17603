"""How thick a mask is along a path, looked at piece by piece."""

import cv2
import numpy as np
import numpy.typing as npt

from schemas.bit_mask import BitMask
from tasks.measurement.centreline import Points

CHUNK_PX = 200  # pixels of a path looked at together, so that a long crack needs no large window
MARGIN_PX = 32  # looked at around them at first; more where the mask is thicker


def thickness_px(mask: BitMask, path: Points) -> npt.NDArray[np.float64]:
    """(N,) twice the distance from each pixel (x, y) of a path to where the mask ends."""
    y, x = np.rint(path[:, ::-1]).astype(np.intp).T
    chunks = [slice(first, first + CHUNK_PX) for first in range(0, len(path), CHUNK_PX)]
    return 2.0 * np.concatenate([_to_the_rim(mask, y[chunk], x[chunk]) for chunk in chunks])


def _to_the_rim(mask: BitMask, y: npt.NDArray[np.intp], x: npt.NDArray[np.intp]) -> npt.NDArray[np.float64]:
    margin = MARGIN_PX
    while True:
        y0, y1 = max(0, int(y.min()) - margin), min(mask.height_px, int(y.max()) + margin + 1)
        x0, x1 = max(0, int(x.min()) - margin), min(mask.width_px, int(x.max()) + margin + 1)
        inside = mask.read(y0, y1, x0, x1).view(np.uint8)
        away = cv2.distanceTransform(inside, cv2.DIST_L2, 5)[y - y0, x - x0]
        if away.max() < margin or inside.size == mask.height_px * mask.width_px:
            return np.asarray(away, dtype=np.float64)
        margin *= 2
