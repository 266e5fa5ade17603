"""Multi-band blending (Burt & Adelson 1983): coarse bands mix over wide seams, fine ones over narrow."""

import cv2
import numba
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
            lower: Layer = np.asarray(cv2.pyrDown(layer), np.float32) if k < BANDS else layer
            coarse = np.asarray(cv2.pyrUp(lower), np.float32) if k < BANDS else np.zeros_like(layer)
            _accumulate(self._sum[k][window], self._weight[k][window], layer, coarse, mask)
            layer, mask = lower, np.asarray(cv2.pyrDown(mask), np.float32)

    def result(self) -> npt.NDArray[np.uint8]:
        """(H, W, 3), 0 where no layer reaches. To be asked once."""
        image = np.zeros_like(self._sum[BANDS])
        for k in range(BANDS, 0, -1):
            _collapse(self._sum[k], self._weight[k], image)
            image = np.asarray(cv2.pyrUp(self._sum[k]), np.float32)
        return np.asarray(_levels(self._sum[0], self._weight[0], image), np.uint8)


@numba.njit(cache=True, nogil=True)
def _accumulate(total: Layer, weight: Layer, layer: Layer, coarse: Layer, mask: Layer) -> None:
    """total += (layer − coarse) · mask, weight += mask."""
    for y in range(mask.shape[0]):
        for x in range(mask.shape[1]):
            share = mask[y, x]
            if share > 0.0:
                weight[y, x] += share
                for c in range(3):
                    total[y, x, c] += (layer[y, x, c] - coarse[y, x, c]) * share


@numba.njit(cache=True, nogil=True)
def _collapse(total: Layer, weight: Layer, coarse: Layer) -> None:
    """total = total / weight + coarse, in place."""
    for y in range(weight.shape[0]):
        for x in range(weight.shape[1]):
            share = np.float32(1.0) / max(weight[y, x], np.float32(1e-4))
            for c in range(3):
                total[y, x, c] = total[y, x, c] * share + coarse[y, x, c]


@numba.njit(cache=True, nogil=True)
def _levels(total: Layer, weight: Layer, coarse: Layer) -> npt.NDArray[np.uint8]:
    """The same of the finest band, rounded to grey levels."""
    levels = np.empty(total.shape, np.uint8)
    for y in range(weight.shape[0]):
        for x in range(weight.shape[1]):
            share = np.float32(1.0) / max(weight[y, x], np.float32(1e-4))
            for c in range(3):
                level = np.rint(total[y, x, c] * share + coarse[y, x, c])
                levels[y, x, c] = np.uint8(min(max(level, np.float32(0.0)), np.float32(255.0)))
    return levels
