"""Precision, recall and F1 of crack masks against masks drawn by people.

At a tolerance of d px a found pixel is right if a true one lies within d px (Euclidean), and a true one
counts as found if a found one lies within d px.
"""

from collections.abc import Iterable
from typing import NamedTuple

import cv2
import numpy as np
import numpy.typing as npt

from schemas.evaluation import Evaluation, Scores

TOLERANCES_PX = (0, 2)

Mask = npt.NDArray[np.bool_]


class Counts(NamedTuple):
    """Pixels of one image, or summed over many."""

    found_right: int
    found: int
    true_found: int
    true: int


def count(found: Mask, truth: Mask, tolerance_px: int) -> Counts:
    """Both masks (H, W) bool."""
    near_truth, near_found = _dilated(truth, tolerance_px), _dilated(found, tolerance_px)
    return Counts(
        int((found & near_truth).sum()), int(found.sum()), int((truth & near_found).sum()), int(truth.sum())
    )


def scores(counts: Counts) -> Scores:
    """Finding nothing where there is nothing is perfect; what is undefined otherwise is zero."""
    if counts.found == 0 and counts.true == 0:
        return Scores(precision=1.0, recall=1.0, f1=1.0)
    precision = counts.found_right / counts.found if counts.found else 0.0
    recall = counts.true_found / counts.true if counts.true else 0.0
    both = precision + recall
    return Scores(precision=precision, recall=recall, f1=2 * precision * recall / both if both else 0.0)


def evaluate(method: str, pairs: Iterable[tuple[Mask, Mask]]) -> tuple[Evaluation, ...]:
    """One Evaluation for each tolerance over (found, truth) masks; at least one pair."""
    counted = [[count(found, truth, d) for d in TOLERANCES_PX] for found, truth in pairs]
    evaluations = []
    for column, tolerance in enumerate(TOLERANCES_PX):
        of_images = [scores(row[column]) for row in counted]
        total = Counts(*(int(n) for n in np.sum([row[column] for row in counted], axis=0)))
        mean = Scores(
            precision=float(np.mean([s.precision for s in of_images])),
            recall=float(np.mean([s.recall for s in of_images])),
            f1=float(np.mean([s.f1 for s in of_images])),
        )
        evaluations.append(
            Evaluation(
                method=method, tolerance_px=tolerance, images=len(counted), aggregate=scores(total), mean=mean
            )
        )
    return tuple(evaluations)


def _dilated(mask: Mask, radius_px: int) -> Mask:
    if radius_px == 0:
        return mask
    reach = np.arange(-radius_px, radius_px + 1)
    disc = (reach[:, None] ** 2 + reach**2 <= radius_px**2).astype(np.uint8)
    return np.asarray(cv2.dilate(mask.astype(np.uint8), disc) > 0)
