"""Which pairs of photos are worth matching: neighbours by their priors, and by their look where these do not
tell."""

from collections.abc import Mapping, Sequence

import numpy as np

from tasks.stitching.matching import Descriptors, match
from tasks.stitching.prior import Prior
from tasks.stitching.tracks import Index
from tasks.stitching.view import Array

NEIGHBOURS = 12  # most pairs a photo asks for: keeps the cost linear in photos
ALL_PAIRS = 24  # photos without positions, up to which every pair is tried
LARGEST = 300  # features by which photos are compared before they are matched
WITHIN = 100  # most photos that one is compared with by look where its position is too unsure to choose


def candidate_pairs(
    priors: Sequence[Prior], scales: Sequence[Array], descriptors: Sequence[Descriptors]
) -> list[tuple[int, int]]:
    """Sorted pairs (i < j) that may overlap."""
    everyone = np.arange(len(priors))
    unplaced = [i for i, p in enumerate(priors) if not p.has_position]
    pairs, unsure = _by_position(priors)
    if len(priors) <= ALL_PAIRS:
        return sorted(pairs | {_pair(i, j) for i in [*unplaced, *unsure] for j in everyone if i != j})
    asking = unsure | {i: everyone[everyone != i] for i in unplaced}
    return sorted(pairs | _by_look(asking, scales, descriptors))


def _pair(i: int, j: int) -> tuple[int, int]:
    return min(int(i), int(j)), max(int(i), int(j))


def _by_position(priors: Sequence[Prior]) -> tuple[set[tuple[int, int]], dict[int, Index]]:
    """Footprints, grown by three sigma of their error, that meet: the nearest of each. Where two photos'
    errors reach half the usual way to these, the nearest need not be neighbours: then all others too."""
    placed = np.array([i for i, p in enumerate(priors) if p.has_position], np.int64)
    if len(placed) < 2:
        return set(), {}
    centres = np.array([priors[i].view.centre_uv for i in placed])
    reach = np.array([_reach(priors[i]) for i in placed])
    distance = np.linalg.norm(centres[:, None] - centres[None], axis=2)
    meets = distance < reach[:, None] + reach[None]
    np.fill_diagonal(meets, False)
    usual = float(np.median(np.sort(distance, axis=1)[:, min(NEIGHBOURS, len(placed) - 1)]))
    pairs: set[tuple[int, int]] = set()
    unsure: dict[int, Index] = {}
    for row, i in enumerate(placed):
        near = np.flatnonzero(meets[row])
        near = placed[near[np.argsort(distance[row, near], kind="stable")]]
        pairs |= {_pair(i, j) for j in near[:NEIGHBOURS]}
        if len(near) > NEIGHBOURS and np.sqrt(2.0) * _error(priors[i]) > usual / 2.0:
            unsure[int(i)] = near[:WITHIN]
    return pairs, unsure


def _error(prior: Prior) -> float:
    """1σ of where the photo's middle lies on the plane."""
    swing = prior.view.C[2] * float(np.max(prior.sigma_rotation[:2]))
    return float(np.hypot(np.max(prior.sigma_position[:2]), swing))


def _reach(prior: Prior) -> float:
    """Radius of the footprint plus three sigma of where it may lie; infinite at an unknown distance."""
    if not np.isfinite(prior.sigma_position[2]):
        return float("inf")
    view = prior.view
    radius = float(np.nanmax(np.linalg.norm(view.outline_uv - view.centre_uv, axis=1)))
    return radius + 3.0 * _error(prior)


def _by_look(
    asking: Mapping[int, Index], scales: Sequence[Array], descriptors: Sequence[Descriptors]
) -> set[tuple[int, int]]:
    """asking: photo → those to compare it with. The photos that share most of their largest features."""
    few = [d[np.argsort(-s, kind="stable")[:LARGEST]] for s, d in zip(scales, descriptors, strict=True)]
    to_compare = sorted({_pair(i, j) for i, others in asking.items() for j in others})
    shared = {(i, j): len(match(few[i], few[j])) for i, j in to_compare}
    pairs: set[tuple[int, int]] = set()
    for i, others in asking.items():
        score = np.array([shared[_pair(i, j)] for j in others])
        best = np.argsort(-score, kind="stable")[:NEIGHBOURS]
        pairs |= {_pair(i, others[k]) for k in best if score[k] > 0}
    return pairs
