"""Connected dark pixels, told apart by their shape: cracks are long and thin."""

from typing import NamedTuple

import cv2
import numpy as np
import numpy.typing as npt

from tasks.detection.sauvola import Mask

ELONGATION = 5.0  # least extent over mean width of a crack, and of a crack's network
THROUGH = 2.7  # of one that runs through the image; a disc has 2.5


class Components(NamedTuple):
    """8-connected components. Label 0 is the background; arrays are indexed by label."""

    labels: npt.NDArray[np.int32]  # (H, W)
    area_px: npt.NDArray[np.float64]
    boxes: npt.NDArray[np.int32]  # (n, 4) x, y, width, height

    @property
    def extent_px(self) -> npt.NDArray[np.float64]:
        """Diagonal of the bounding box."""
        return np.hypot(self.boxes[:, 2], self.boxes[:, 3])

    @property
    def elongation(self) -> npt.NDArray[np.float64]:
        """Extent over mean width; a full square has 2, a disc 2.5, a crack of 3 × 100 px 33."""
        return self.extent_px**2 / np.maximum(self.area_px, 1.0)

    @property
    def thin(self) -> npt.NDArray[np.bool_]:
        """Which are as thin as cracks. Of what runs through the image from side to side, seen from near,
        nobody sees how long it is: there less is enough."""
        x, y, width, height = self.boxes.T
        high, wide = self.labels.shape
        through = ((x == 0) & (width == wide)) | ((y == 0) & (height == high))
        return np.asarray(self.elongation >= np.where(through, THROUGH, ELONGATION))

    def box(self, label: int) -> tuple[int, int, int, int]:
        x, y, width, height = (int(n) for n in self.boxes[label])
        return x, y, width, height

    def holding(self, mask: Mask) -> npt.NDArray[np.bool_]:
        """Which components have a pixel in `mask`."""
        return np.bincount(self.labels[mask], minlength=len(self.area_px)) > 0

    def keep(self, which: npt.NDArray[np.bool_]) -> Mask:
        """(H, W) mask of the components chosen, the background never."""
        chosen = which.copy()
        chosen[0] = False
        return np.asarray(chosen[self.labels])


def components(mask: Mask) -> Components:
    _, labels, stats, _ = cv2.connectedComponentsWithStats(mask.astype(np.uint8), connectivity=8)
    area = stats[:, cv2.CC_STAT_AREA].astype(np.float64)
    return Components(np.asarray(labels, dtype=np.int32), area, np.asarray(stats[:, :4], dtype=np.int32))


def long_and_thin(levels: npt.NDArray[np.uint8], seed_level: int, min_length_px: float) -> Mask:
    """Components of non-zero `levels` that are long, thin and hold a pixel of at least `seed_level`."""
    found = components(levels > 0)
    which = (found.extent_px >= min_length_px) & found.thin
    return found.keep(which & found.holding(levels >= seed_level))
