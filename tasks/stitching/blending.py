"""Multi-band blending (Burt & Adelson 1983): coarse bands mix over wide seams, fine ones over narrow.

The finest band, which no other photo has a say in, is asked of a layer where the layer is shown alone; all
others of the layer at half its size, which goes as far as they mix."""

import cv2
import numba
import numpy as np
import numpy.typing as npt

Layer = npt.NDArray[np.float32]
Mask = npt.NDArray[np.bool_]

BANDS = 5  # the coarsest mixes over about 2⁵ pixels to either side
ALIGN = 2**BANDS  # windows start on multiples of it, so that tiles are one blend
REACH = 4 * ALIGN  # no pixel farther than this from another has a say in it


class MultiBand:
    """Blends layers into one window, of which all is shown but a rim; the window's corner and size are
    multiples of ALIGN, the rim is even, 4 px or more."""

    def __init__(self, width: int, height: int, rim: int) -> None:
        self._rim = rim
        self._finest = np.zeros((height - 2 * rim, width - 2 * rim, 3), np.float32)
        sizes = [(height >> k, width >> k) for k in range(1, BANDS + 1)]
        self._sum = [np.zeros((*size, 3), np.float32) for size in sizes]
        self._weight = [np.zeros(size, np.float32) for size in sizes]

    def add(self, half: Layer, mask: Layer, x: int, y: int) -> None:
        """`half` (h / 2, w / 2, 3), valid all over, its pixels every second of the window's; `mask` (h, w),
        1 where the layer is wanted; corner and size aligned."""
        layer, share = half, np.asarray(cv2.pyrDown(mask), np.float32)
        for k in range(BANDS):
            top, left = y >> (k + 1), x >> (k + 1)
            window = (slice(top, top + share.shape[0]), slice(left, left + share.shape[1]))
            last = k == BANDS - 1
            lower: Layer = layer if last else np.asarray(cv2.pyrDown(layer), np.float32)
            coarse = np.zeros_like(layer) if last else np.asarray(cv2.pyrUp(lower), np.float32)
            _accumulate(self._sum[k][window], self._weight[k][window], layer, coarse, share)
            layer, share = lower, np.asarray(cv2.pyrDown(share), np.float32)

    def add_finest(self, layer: Layer, half: Layer, mask: Mask, x: int, y: int) -> None:
        """`layer` and `mask` (h, w): where it is wanted alone; `half` (h / 2 + 4, w / 2 + 4, 3) goes two of
        its pixels further on each side. Corner, counted from where the rim ends, and size are even."""
        coarse = np.asarray(cv2.pyrUp(half), np.float32)[4:-4, 4:-4]
        _set(self._finest[y : y + mask.shape[0], x : x + mask.shape[1]], layer, coarse, mask)

    def result(self) -> npt.NDArray[np.uint8]:
        """(H, W, 3) inside the rim; nothing of use where no layer was wanted. To be asked once."""
        image = np.zeros_like(self._sum[-1])
        for total, weight in zip(self._sum[:0:-1], self._weight[:0:-1], strict=True):
            _collapse(total, weight, image)
            image = np.asarray(cv2.pyrUp(total), np.float32)
        cut = self._rim // 2 - 2
        inner = (slice(cut, image.shape[0] - cut), slice(cut, image.shape[1] - cut))
        shown = np.ascontiguousarray(self._sum[0][inner])
        _collapse(shown, self._weight[0][inner], image[inner])
        return np.asarray(
            _levels(self._finest, np.asarray(cv2.pyrUp(shown), np.float32)[4:-4, 4:-4]), np.uint8
        )


@numba.njit(cache=True, nogil=True)
def _set(band: Layer, layer: Layer, coarse: Layer, mask: Mask) -> None:
    """band = layer − coarse where the mask is set."""
    for y in range(mask.shape[0]):
        for x in range(mask.shape[1]):
            if mask[y, x]:
                for c in range(3):
                    band[y, x, c] = layer[y, x, c] - coarse[y, x, c]


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
def _levels(finest: Layer, coarse: Layer) -> npt.NDArray[np.uint8]:
    """Their sum, rounded to grey levels."""
    levels = np.empty(finest.shape, np.uint8)
    for y in range(finest.shape[0]):
        for x in range(finest.shape[1]):
            for c in range(3):
                level = np.rint(finest[y, x, c] + coarse[y, x, c])
                levels[y, x, c] = np.uint8(min(max(level, np.float32(0.0)), np.float32(255.0)))
    return levels
