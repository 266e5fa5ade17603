"""Where each photo lies, roughly: a similarity each, averaged over all matched pairs.

First guesses for the adjustment. Scale, turn and shift are solved one after the other, each linear (scale by
its logarithm), so nothing drifts along chains and nothing can shrink to a point; pairs that disagree with the
rest of the graph (repeated texture) are found and dropped."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import breadth_first_order, connected_components, minimum_spanning_tree

from tasks.stitching.pairs import Edge, PhotoFeatures
from tasks.stitching.prior import Prior
from tasks.stitching.skyline import solve_positive
from tasks.stitching.view import Array, View

ROUNDS = 8  # of reweighting
FALSE_TURN = np.radians(12.0)  # a pair that disagrees by more with the rest is false
FALSE_SCALE = 0.25  # logarithm of scale
FALSE_SHIFT = 0.15  # of the photo's width
FEWEST_MET = 4  # matches on the plane that make a similarity worth looking at


@dataclass(frozen=True)
class Guess:
    views: tuple[View, ...]  # one a photo; its prior where nothing was matched
    edges: tuple[Edge, ...]  # without those that are false, or lie beyond a horizon
    component: npt.NDArray[np.int64]  # (N,) connected photos share a number; the largest is 0


def average(
    edges: Sequence[Edge],
    features: Sequence[PhotoFeatures],
    priors: Sequence[Prior],
    sigma_bias: Array,
) -> Guess:
    """sigma_bias: (3,) of the error that all prior positions share."""
    views = [p.view for p in priors]
    kept = [(e, one) for e in edges if (one := _similarity(e, features, views)) is not None]
    while True:
        chosen, measured = [e for e, _ in kept], [one for _, one in kept]
        component = _components(chosen, len(views))
        log_scale, angle, shift, good = _solve(chosen, measured, len(views), component, views)
        if good.all():
            break
        kept = [one for one, is_good in zip(kept, good, strict=True) if is_good]
    moved = [
        view.moved(float(np.exp(log_scale[i])), float(angle[i]), shift[i]) for i, view in enumerate(views)
    ]
    for number in range(int(component.max(initial=-1)) + 1):
        members = np.flatnonzero(component == number)
        if len(members) == 1:
            moved[members[0]] = views[members[0]]
        else:
            _anchor(moved, members, priors, float(sigma_bias[2]))
    return Guess(tuple(moved), tuple(chosen), component)


@dataclass(frozen=True)
class _Similarity:
    """q_b = exp(log_scale) · rotation(angle) · q_a + shift, on the plane as the first views see it."""

    log_scale: float
    angle: float
    a: Array  # (2,) mean of the matched points as a sees them
    b: Array
    weight: float


def _similarity(edge: Edge, features: Sequence[PhotoFeatures], views: Sequence[View]) -> _Similarity | None:
    """None where hardly any of the matches lies below both photos' horizons."""
    qa = views[edge.a].to_plane(features[edge.a].xy[edge.matches[:, 0]])
    qb = views[edge.b].to_plane(features[edge.b].xy[edge.matches[:, 1]])
    met = np.isfinite(qa).all(axis=1) & np.isfinite(qb).all(axis=1)
    if met.sum() < FEWEST_MET:
        return None
    qa, qb = qa[met], qb[met]
    a, b = qa.mean(axis=0), qb.mean(axis=0)
    za, zb = (qa - a) @ [1, 1j], (qb - b) @ [1, 1j]
    factor = np.sum(np.conj(za) * zb) / np.sum(np.abs(za) ** 2)
    weight = float(np.sqrt(len(qa)))
    return _Similarity(float(np.log(np.abs(factor) + 1e-12)), float(np.angle(factor)), a, b, weight)


def _components(edges: Sequence[Edge], count: int) -> npt.NDArray[np.int64]:
    """Numbered by falling size, then by the first photo."""
    rows, columns = [e.a for e in edges], [e.b for e in edges]
    graph = coo_matrix((np.ones(len(edges)), (rows, columns)), shape=(count, count))
    _, label = connected_components(graph, directed=False)
    sizes = np.bincount(label, minlength=1)
    first = np.array([int(np.argmax(label == k)) for k in range(len(sizes))])
    number = np.empty(len(sizes), np.int64)
    number[np.lexsort((first, -sizes))] = np.arange(len(sizes))
    return np.asarray(number[label])


def _solve(
    edges: Sequence[Edge],
    measured: Sequence[_Similarity],
    count: int,
    component: npt.NDArray[np.int64],
    views: Sequence[View],
) -> tuple[Array, Array, Array, npt.NDArray[np.bool_]]:
    """T_a(q_a) = T_b(q_b) for every edge: log scale, angle (rad) and shift of each T, and which edges fit."""
    if not edges:
        return np.zeros(count), np.zeros(count), np.zeros((count, 2)), np.ones(0, bool)
    a, b = np.array([e.a for e in edges]), np.array([e.b for e in edges])
    weight = np.array([m.weight for m in measured])
    log_ratio = np.array([m.log_scale for m in measured])  # log s_a − log s_b
    turn = np.array([m.angle for m in measured])
    log_scale, off_scale = _differences(a, b, log_ratio, weight, count, component, 0.02)
    angle = _tree_angles(edges, turn, weight, count)
    rest = np.angle(np.exp(1j * (turn - angle[a] + angle[b])))
    correction, off_turn = _differences(a, b, rest, weight, count, component, np.radians(1.0))
    angle = angle + correction
    factor = np.exp(log_scale + 1j * angle)
    za = factor[a] * (np.array([m.a for m in measured]) @ [1, 1j])
    zb = factor[b] * (np.array([m.b for m in measured]) @ [1, 1j])
    width = np.array([v.units_per_px * v.camera.width_px for v in views]) * np.exp(log_scale)
    usual = float(np.median(width[a]))
    shift = np.zeros((count, 2))
    off = np.zeros((len(edges), 2))
    step = zb - za  # t_a − t_b
    for k, part in enumerate((step.real, step.imag)):
        shift[:, k], off[:, k] = _differences(a, b, part, weight, count, component, 0.01 * usual)
    false = (np.abs(off_turn) > FALSE_TURN) | (np.abs(off_scale) > FALSE_SCALE)
    if not false.any():
        false = np.linalg.norm(off, axis=1) > FALSE_SHIFT * np.minimum(width[a], width[b])
    return log_scale, angle, shift, ~false


def _differences(
    a: npt.NDArray[np.int64],
    b: npt.NDArray[np.int64],
    measured: Array,
    weight: Array,
    count: int,
    component: npt.NDArray[np.int64],
    soft: float,
) -> tuple[Array, Array]:
    """x with x_a − x_b = measured, L1 beyond `soft` (reweighted least squares), mean zero in each component;
    and what is left of each equation."""
    x = np.zeros(count)
    left = measured.copy()
    robust = np.ones(len(measured))
    for _ in range(ROUNDS):
        w = weight * robust
        A = np.zeros((count, count))
        np.add.at(A, (a, a), w)
        np.add.at(A, (b, b), w)
        np.add.at(A, (a, b), -w)
        np.add.at(A, (b, a), -w)
        A[np.diag_indices(count)] += 1e-9 * max(float(w.max()), 1.0)
        right = np.zeros(count)
        np.add.at(right, a, w * measured)
        np.add.at(right, b, -w * measured)
        x = solve_positive(A, right)
        left = measured - x[a] + x[b]
        robust = 1.0 / np.maximum(np.abs(left) / soft, 1.0)
    means = np.bincount(component, x) / np.bincount(component)
    return x - means[component], left


def _tree_angles(edges: Sequence[Edge], turn: Array, weight: Array, count: int) -> Array:
    """Angles along the tree of the strongest edges: free of wraps, for the linear solve to correct."""
    by_pair = {(e.a, e.b): t for e, t in zip(edges, turn, strict=True)}
    graph = coo_matrix((1.0 / weight, ([e.a for e in edges], [e.b for e in edges])), shape=(count, count))
    tree = minimum_spanning_tree(graph.tocsr())
    angle = np.zeros(count)
    seen = np.zeros(count, bool)
    for root in range(count):
        if seen[root]:
            continue
        order, before = breadth_first_order(tree, root, directed=False)
        seen[order] = True
        for node in order[1:]:
            parent = int(before[node])
            known = by_pair.get((parent, int(node)))
            angle[node] = (
                angle[parent] - known if known is not None else angle[parent] + by_pair[(int(node), parent)]
            )
    return angle


def _anchor(
    views: list[View], members: npt.NDArray[np.int64], priors: Sequence[Prior], sigma_bias_w: float
) -> None:
    """Lay a connected group over its priors by one similarity z → f·z + t (complex), linear in f and t.

    Beside the positions, the priors' own scale and turn count, as far as they are known."""
    rows, right = [], []
    shared = sigma_bias_w * float(np.sqrt(len(members)))  # all distances together know it no better than one
    for i in members:
        prior = priors[i]
        turned = np.angle(np.trace(views[i].R[:2, :2].T @ prior.view.R[:2, :2]) + 1j * _skew(views[i], prior))
        ratio = prior.view.C[2] / views[i].C[2]
        sigma_ratio = ratio * float(np.hypot(prior.sigma_position[2], shared)) / prior.view.C[2]
        if np.isfinite(sigma_ratio) and np.isfinite(prior.sigma_rotation[2]):
            sigma = float(np.hypot(sigma_ratio, ratio * prior.sigma_rotation[2]))
            rows.append(np.array([1.0, 0.0]) / sigma)
            right.append(ratio * np.exp(1j * turned) / sigma)
        if prior.has_position:
            sigma = float(prior.sigma_position[:2].max())
            rows.append(np.array([views[i].C[:2] @ [1, 1j], 1.0]) / sigma)
            right.append(prior.view.C[:2] @ [1, 1j] / sigma)
    if np.linalg.matrix_rank(np.array(rows).reshape(-1, 2), tol=1e-6) < 2:
        return
    factor, shift = np.linalg.lstsq(np.array(rows), np.array(right), rcond=None)[0]
    if np.abs(factor) < 1e-6:
        return
    for i in members:
        views[i] = views[i].moved(
            float(np.abs(factor)), float(np.angle(factor)), np.array([shift.real, shift.imag])
        )


def _skew(view: View, prior: Prior) -> float:
    """sin part of the turn about w from the view's to the prior's camera axes."""
    own, wanted = view.R[:2, :2], prior.view.R[:2, :2]
    return float(np.sum(own[0] * wanted[1] - own[1] * wanted[0]))
