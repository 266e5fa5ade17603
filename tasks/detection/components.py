"""Connected dark pixels, told apart by their shape: cracks are long and thin."""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from tasks.connected import Indices, Marked, connected

ELONGATION = 5.0  # least extent over mean width of a crack, and of a crack's network
THROUGH = 2.7  # of one that runs through the image; a disc has 2.5


class Components(NamedTuple):
    """What of some pixels hangs together. Arrays are indexed by label; label 0 is none of them."""

    pixels: Marked
    label: Indices  # (n,) of each pixel, 1 and up
    area_px: npt.NDArray[np.float64]
    boxes: npt.NDArray[np.int32]  # (labels, 4) x, y, width, height

    @property
    def extent_px(self) -> npt.NDArray[np.float64]:
        """Diagonal of the bounding box."""
        return np.hypot(self.boxes[:, 2], self.boxes[:, 3])

    @property
    def elongation(self) -> npt.NDArray[np.float64]:
        """Extent over mean width; a full square has 2, a disc 2.5, a crack of 3 × 100 px 33."""
        return self.extent_px**2 / np.maximum(self.area_px, 1.0)

    @property
    def width_px(self) -> npt.NDArray[np.float64]:
        """Mean length of the runs of pixels along rows, or along columns where these are shorter: up to 1.4
        times the width of what runs diagonally."""
        y, x = self.pixels.y, self.pixels.x
        turned = np.lexsort((y, x))
        rows = np.bincount(self.label[_begins(y, x)], minlength=len(self.area_px))
        columns = np.bincount(self.label[turned][_begins(x[turned], y[turned])], minlength=len(self.area_px))
        return np.asarray(self.area_px / np.maximum(np.maximum(rows, columns), 1))

    @property
    def thin(self) -> npt.NDArray[np.bool_]:
        """Which are as thin as cracks. Of what runs through the image from side to side, seen from near,
        nobody sees how long it is: there less is enough."""
        x, y, width, height = self.boxes.T
        high, wide = self.pixels.height_px, self.pixels.width_px
        through = ((x == 0) & (width == wide)) | ((y == 0) & (height == high))
        return np.asarray(self.elongation >= np.where(through, THROUGH, ELONGATION))

    def box(self, label: int) -> tuple[int, int, int, int]:
        x, y, width, height = (int(n) for n in self.boxes[label])
        return x, y, width, height

    def holding(self, chosen: npt.NDArray[np.bool_]) -> npt.NDArray[np.bool_]:
        """Which components have one of the pixels that (n,) chooses."""
        return np.bincount(self.label[chosen], minlength=len(self.area_px)) > 0

    def keep(self, which: npt.NDArray[np.bool_]) -> Marked:
        """The pixels of the components chosen."""
        return self.pixels.where(which[self.label])


def _begins(line: Indices, at: Indices) -> npt.NDArray[np.bool_]:
    """Which pixels, line by line, begin a run."""
    begins = np.ones(len(line), dtype=bool)
    begins[1:] = (np.diff(line) != 0) | (np.diff(at) != 1)
    return begins


def components(pixels: Marked, reach_px: int = 0) -> Components:
    """8-connected ones, or with gaps of at most 2 reach_px."""
    label, count = connected(pixels, reach_px)
    area = np.bincount(label, minlength=count + 1).astype(np.float64)
    low = np.full((count + 1, 2), np.iinfo(np.int32).max, dtype=np.int32)
    high = np.full((count + 1, 2), -1, dtype=np.int32)
    for n, at in enumerate((pixels.x, pixels.y)):
        np.minimum.at(low[:, n], label, at)
        np.maximum.at(high[:, n], label, at)
    boxes = np.hstack([low, high - low + 1])
    boxes[0] = 0
    return Components(pixels, label, area, boxes)


def long_and_thin(pixels: Marked, seed_level: int, min_length_px: float) -> Marked:
    """Components that are long, thin and hold a pixel of at least `seed_level`."""
    found = components(pixels)
    which = (found.extent_px >= min_length_px) & found.thin
    return found.keep(which & found.holding(pixels.level >= seed_level))
