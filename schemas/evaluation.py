"""How well found cracks agree with masks drawn by people."""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from schemas.contract import Contract, Vector2

Levels = npt.NDArray[np.int64]  # (4, 256) pixels of each level: all, true, near truth; truth by what is near


class Counts(NamedTuple):
    """Pixels of one image, or summed over many."""

    found_right: int
    found: int
    true_found: int
    true: int


class Tally(NamedTuple):
    """Of one image: all that an evaluation needs of it, so that its masks need not be kept."""

    areas: tuple[Counts, ...]  # at each tolerance
    lines: tuple[Counts, ...]
    pixels: int


class Scores(Contract):
    precision: float
    recall: float
    f1: float


class Evaluation(Contract):
    """One method on one set of images, at one tolerance."""

    method: str
    tolerance_px: int  # a pixel counts as right within this distance
    images: int
    aggregate: Scores  # over the pixels of all images
    mean: Scores  # over images, each counting the same
    length: Scores  # of centrelines: the share of found length that is right, of true length that is found
    f1_interval: Vector2  # 95 % of the aggregate F1 when images are drawn anew (bootstrap)
    false_length_per_mpx: float  # pixels of found centreline that are not right, per megapixel of image


class Curves(Contract):
    """A network's probabilities against drawn masks, over all pixels."""

    tolerance_px: int
    threshold: tuple[float, ...]  # (255,) probability from which a pixel is called crack
    precision: tuple[float, ...]  # (255,)
    recall: tuple[float, ...]  # (255,)
    said: tuple[float, ...]  # (≤ 10,) mean probability of the pixels of each tenth
    was: tuple[float, ...]  # share of them that is crack
