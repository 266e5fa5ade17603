"""Gaps within a crack: where a network is not sure of a stretch, but sees something all along it.

Pieces that are sure enough are joined along the middle of what is likely enough between them: its skeleton,
where that leads from one piece to another and no farther than a gap may be.
"""

import numpy as np
import numpy.typing as npt
from skimage.morphology import skeletonize

from tasks.detection.components import Components, components
from tasks.detection.network import Probability
from tasks.detection.sauvola import Mask

LINK = 26  # of 255: what is likelier than a tenth may join two pieces of a crack


def bridged(probability: Probability, edge: int, longest_px: float) -> Mask:
    """(H, W) pixels of at least `edge`, and the bridges of at most `longest_px` pixels between them."""
    strong = probability >= edge
    pieces, weak = components(strong), components(probability >= LINK)
    rows, columns = np.nonzero(strong)
    piece_and_weak = np.unique(
        np.column_stack([pieces.labels[rows, columns], weak.labels[rows, columns]]), axis=0
    )
    held = np.bincount(piece_and_weak[:, 1], minlength=len(weak.area_px))
    joined = strong.copy()
    for label in np.flatnonzero(held >= 2):
        x, y, width, height = weak.box(int(label))
        window = slice(y, y + height), slice(x, x + width)
        patch = np.pad(weak.labels[window] == label, 1)
        middle: Mask = skeletonize(patch)[1:-1, 1:-1]  # type: ignore[no-untyped-call]
        joined[window] |= _between(middle & ~strong[window], pieces.labels[window], longest_px)
    return joined


def _between(middle: Mask, piece: npt.NDArray[np.int32], longest_px: float) -> Mask:
    """Parts of a skeleton that touch two pieces or more."""
    parts: Components = components(middle)
    rows, columns = np.nonzero(middle)
    near = np.pad(piece, 1)
    touched = [
        np.column_stack([parts.labels[rows, columns], near[rows + dy, columns + dx]])
        for dy in range(3)
        for dx in range(3)
    ]
    pairs = np.unique(np.concatenate(touched), axis=0)
    ends = np.bincount(pairs[pairs[:, 1] > 0, 0], minlength=len(parts.area_px))
    return parts.keep((ends >= 2) & (parts.area_px <= longest_px))
