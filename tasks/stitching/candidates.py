"""Which pairs of photos are worth matching: neighbours by their priors, else by their look."""

from collections.abc import Sequence

import numpy as np

from tasks.stitching.matching import Descriptors, match
from tasks.stitching.prior import Prior
from tasks.stitching.view import Array

NEIGHBOURS = 12  # most pairs a photo asks for: keeps the cost linear in photos
ALL_PAIRS = 24  # photos without positions, up to which every pair is tried
LARGEST = 300  # features by which photos are compared before they are matched


def candidate_pairs(
    priors: Sequence[Prior], scales: Sequence[Array], descriptors: Sequence[Descriptors]
) -> list[tuple[int, int]]:
    """Sorted pairs (i < j) that may overlap."""
    unplaced = [i for i, p in enumerate(priors) if not p.has_position]
    pairs = _by_position(priors)
    if unplaced and len(priors) <= ALL_PAIRS:
        pairs |= {(min(i, j), max(i, j)) for i in unplaced for j in range(len(priors)) if i != j}
    elif unplaced:
        pairs |= _by_look(unplaced, scales, descriptors)
    return sorted(pairs)


def _by_position(priors: Sequence[Prior]) -> set[tuple[int, int]]:
    """Footprints, grown by three sigma of their error, that meet; the nearest of each."""
    placed = [i for i, p in enumerate(priors) if p.has_position]
    if len(placed) < 2:
        return set()
    centres = np.array([priors[i].view.centre_uv for i in placed])
    reach = np.array([_reach(priors[i]) for i in placed])
    distance = np.linalg.norm(centres[:, None] - centres[None], axis=2)
    meets = distance < reach[:, None] + reach[None]
    np.fill_diagonal(meets, False)
    pairs: set[tuple[int, int]] = set()
    for row, i in enumerate(placed):
        near = np.flatnonzero(meets[row])
        near = near[np.argsort(distance[row, near], kind="stable")][:NEIGHBOURS]
        pairs |= {(min(i, placed[k]), max(i, placed[k])) for k in near}
    return pairs


def _reach(prior: Prior) -> float:
    """Radius of the footprint plus three sigma of where it may lie; infinite at an unknown distance."""
    if not np.isfinite(prior.sigma_position[2]):
        return float("inf")
    outline = prior.view.outline_uv
    radius = float(np.nanmax(np.linalg.norm(outline - prior.view.centre_uv, axis=1)))
    swing = prior.view.C[2] * float(np.max(prior.sigma_rotation[:2]))
    return radius + 3.0 * float(np.hypot(np.max(prior.sigma_position[:2]), swing))


def _by_look(
    unplaced: Sequence[int], scales: Sequence[Array], descriptors: Sequence[Descriptors]
) -> set[tuple[int, int]]:
    """The photos that share most of their largest features with each."""
    few = [d[np.argsort(-s, kind="stable")[:LARGEST]] for s, d in zip(scales, descriptors, strict=True)]
    score = np.zeros((len(few), len(few)))
    asking = set(unplaced)
    for i in range(len(few)):
        for j in range(i + 1, len(few)):
            if i in asking or j in asking:
                score[i, j] = score[j, i] = len(match(few[i], few[j]))
    pairs: set[tuple[int, int]] = set()
    for i in unplaced:
        best = np.argsort(-score[i], kind="stable")[:NEIGHBOURS]
        pairs |= {(min(i, int(j)), max(i, int(j))) for j in best if score[i, j] > 0}
    return pairs
