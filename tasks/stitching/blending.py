"""Multi-band blending (Burt & Adelson 1983): coarse bands mix over wide seams, fine ones over narrow."""

import cv2
import numpy as np
import numpy.typing as npt

Layer = npt.NDArray[np.float32]

BANDS = 5  # the coarsest mixes over about 2⁵ pixels to either side
ALIGN = 2**BANDS  # windows start on multiples of it, so that tiles are one blend
REACH = 4 * ALIGN  # no pixel farther than this from another has a say in it


class MultiBand:
    """Blends layers into one window; the window's corner and size are multiples of ALIGN."""

    def __init__(self, width: int, height: int) -> None:
        self._sum = [np.zeros((height >> k, width >> k, 3), np.float32) for k in range(BANDS + 1)]
        self._weight = [np.zeros((height >> k, width >> k), np.float32) for k in range(BANDS + 1)]

    def add(self, layer: Layer, mask: Layer, x: int, y: int) -> None:
        """`layer` (h, w, 3), valid all over; `mask` (h, w), 1 where it is wanted; corner, size aligned."""
        for k in range(BANDS + 1):
            window = (slice(y >> k, (y >> k) + mask.shape[0]), slice(x >> k, (x >> k) + mask.shape[1]))
            if k < BANDS:
                lower: Layer = np.asarray(cv2.pyrDown(layer), np.float32)
                band: Layer = layer - np.asarray(cv2.pyrUp(lower), np.float32)
            else:
                lower, band = layer, layer
            self._sum[k][window] += band * mask[..., None]
            self._weight[k][window] += mask
            layer, mask = lower, np.asarray(cv2.pyrDown(mask), np.float32)

    def result(self) -> npt.NDArray[np.uint8]:
        """(H, W, 3), 0 where no layer reaches."""
        image = self._band(BANDS)
        for k in range(BANDS - 1, -1, -1):
            image = self._band(k) + np.asarray(cv2.pyrUp(image), np.float32)
        return np.clip(np.rint(image), 0, 255).astype(np.uint8)

    def _band(self, k: int) -> Layer:
        return np.asarray(self._sum[k] / np.maximum(self._weight[k], 1e-4)[..., None], np.float32)
