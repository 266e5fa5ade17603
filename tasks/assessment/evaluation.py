"""Precision, recall and F1 of crack masks against masks drawn by people.

At a tolerance of d px a found pixel is right if a true one lies within d px (Euclidean), and a true one
counts as found if a found one lies within d px. Pixels score the style of a label as much as detection: one
pixel of rim on a perfect mask of four gives F1 .80. So centrelines are scored as well, each against the
other's: that is length found and length false, which an engineer reads.
"""

from collections.abc import Sequence

import cv2
import numpy as np
import numpy.typing as npt

from schemas.evaluation import Counts, Evaluation, Scores, Tally

TOLERANCES_PX = (0, 2, 5)
DRAWN_ANEW = 1000  # bootstrap samples
SEED = 0

Mask = npt.NDArray[np.bool_]


def count(found: Mask, truth: Mask, tolerance_px: int) -> Counts:
    """Both masks (H, W) bool."""
    near_truth, near_found = near(truth, tolerance_px), near(found, tolerance_px)
    return Counts(
        int((found & near_truth).sum()), int(found.sum()), int((truth & near_found).sum()), int(truth.sum())
    )


def centreline(mask: Mask) -> Mask:
    """The mask thinned to one pixel (Zhang & Suen 1984)."""
    from skimage.morphology import skeletonize

    return np.asarray(skeletonize(mask) > 0)  # type: ignore[no-untyped-call]


def scores(counts: Counts) -> Scores:
    """Finding nothing where there is nothing is perfect; what is undefined otherwise is zero."""
    if counts.found == 0 and counts.true == 0:
        return Scores(precision=1.0, recall=1.0, f1=1.0)
    precision = counts.found_right / counts.found if counts.found else 0.0
    recall = counts.true_found / counts.true if counts.true else 0.0
    both = precision + recall
    return Scores(precision=precision, recall=recall, f1=2 * precision * recall / both if both else 0.0)


def tally(found: Mask, truth: Mask) -> Tally:
    thin = centreline(found), centreline(truth)
    areas = tuple(count(found, truth, d) for d in TOLERANCES_PX)
    return Tally(areas, tuple(count(*thin, d) for d in TOLERANCES_PX), found.size)


def evaluate(method: str, images: Sequence[Tally]) -> tuple[Evaluation, ...]:
    """One Evaluation for each tolerance; at least one image."""
    pixels = sum(one.pixels for one in images)
    return tuple(
        _evaluation(method, d, [one.areas[k] for one in images], [one.lines[k] for one in images], pixels)
        for k, d in enumerate(TOLERANCES_PX)
    )


def _evaluation(
    method: str, tolerance_px: int, areas: list[Counts], lines: list[Counts], pixels: int
) -> Evaluation:
    of_images = [scores(one) for one in areas]
    length = _sum(lines)
    return Evaluation(
        method=method,
        tolerance_px=tolerance_px,
        images=len(areas),
        aggregate=scores(_sum(areas)),
        mean=Scores(
            precision=float(np.mean([s.precision for s in of_images])),
            recall=float(np.mean([s.recall for s in of_images])),
            f1=float(np.mean([s.f1 for s in of_images])),
        ),
        length=scores(length),
        f1_interval=_interval(areas),
        false_length_per_mpx=round((length.found - length.found_right) / (pixels / 1e6), 2),
    )


def _sum(counts: list[Counts]) -> Counts:
    return Counts(*(int(n) for n in np.sum(counts, axis=0)))


def _interval(counts: list[Counts]) -> tuple[float, float]:
    """2.5th and 97.5th percentile of the aggregate F1 over images drawn with replacement."""
    drawn = np.random.default_rng(SEED).integers(len(counts), size=(DRAWN_ANEW, len(counts)))
    f1 = [scores(Counts(*row)).f1 for row in np.asarray(counts)[drawn].sum(axis=1).tolist()]
    low, high = np.percentile(f1, (2.5, 97.5))
    return round(float(low), 4), round(float(high), 4)


def near(mask: Mask, radius_px: int) -> Mask:
    """Pixels that lie within `radius_px` (Euclidean) of the mask."""
    if radius_px == 0:
        return mask
    return np.asarray(cv2.dilate(mask.astype(np.uint8), disc(radius_px)) > 0)


def disc(radius_px: int) -> npt.NDArray[np.uint8]:
    reach = np.arange(-radius_px, radius_px + 1)
    return (reach[:, None] ** 2 + reach**2 <= radius_px**2).astype(np.uint8)
