"""From crack pixels to paths: the skeleton as a graph, gaps bridged, spurs left out.

A crack is the longest path through its part of the skeleton; what is left when that is taken out are its
branches, treated the same way. Pixels are nodes, neighbours are joined by their distance.
"""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.sparse import coo_array, csr_array
from scipy.sparse.csgraph import connected_components, dijkstra
from scipy.spatial import cKDTree
from skimage.morphology import skeletonize

from schemas.bit_mask import BitMask
from tasks.connected import Indices, Marked, connected

Points = npt.NDArray[np.float64]  # (N, 2) x, y in pixels

FORWARD_DEG = 50.0  # a gap is bridged only where both ends point across it within this angle
LOOK_BACK_PX = 12  # an end's direction is taken from this much of its skeleton
TILE_PX = 2048  # of a component that is larger are thinned together
HALO_PX = 256  # and as much around: thinning looks no further than half a crack's width


class Path(NamedTuple):
    points: Points  # from end to end, pixel by pixel
    network: int  # paths of one connected crack share it


def crack_paths(mask: BitMask, least_px: float, gap_px: float) -> list[Path]:
    """Paths of at least `least_px`, longest first within each network; gaps up to `gap_px` are bridged."""
    nodes = skeleton_pixels(mask)
    if len(nodes) == 0:
        return []
    graph = _join_gaps(nodes, _neighbours(nodes), gap_px)
    _, network = connected_components(graph, directed=False)
    paths = []
    for n, members in enumerate(_members(network)):
        if len(members) < 2:
            continue
        inside = csr_array(graph[members][:, members])
        paths += [Path(nodes[members[chain]], n) for chain in _longest_paths(inside, least_px)]
    return paths


def _members(group: npt.NDArray[np.integer]) -> list[npt.NDArray[np.intp]]:
    """The indices of each group, from 0 up."""
    order = np.argsort(group, kind="stable")
    return np.split(order, np.cumsum(np.bincount(group))[:-1])


def skeleton_pixels(mask: BitMask) -> Points:
    """(N, 2) pixels of the skeleton, component by component so that a large image costs no memory."""
    pixels = Marked.of(mask)
    label, _ = connected(pixels)
    found = [np.empty((0, 2))]
    for index in _members(label)[1:]:
        found += _thinned(pixels.y[index], pixels.x[index])
    return np.concatenate(found)


def _thinned(y: Indices, x: Indices) -> list[Points]:
    """Skeleton pixels of the component that has these pixels, row by row; tile by tile where it is large."""
    parts = []
    low, high = int(x.min()), int(x.max()) + 1
    for top in range(int(y[0]), int(y[-1]) + 1, TILE_PX):
        rows = slice(*np.searchsorted(y, (top - HALO_PX, top + TILE_PX + HALO_PX)))
        for left in range(low, high, TILE_PX):
            here = (x[rows] >= left - HALO_PX) & (x[rows] < left + TILE_PX + HALO_PX)
            if not here.any():
                continue
            yy, xx = y[rows][here], x[rows][here]
            y0, x0 = int(yy[0]) - 1, int(xx.min()) - 1
            patch = np.zeros((int(yy[-1]) - y0 + 2, int(xx.max()) - x0 + 2), dtype=bool)
            patch[yy - y0, xx - x0] = True
            # Zhang's, the default, eats up to 13 px of an end of an even diagonal stroke; Lee's does not
            v, u = np.nonzero(skeletonize(patch, method="lee"))  # type: ignore[no-untyped-call]
            own = (v + y0 >= top) & (v + y0 < top + TILE_PX) & (u + x0 >= left) & (u + x0 < left + TILE_PX)
            parts.append(np.column_stack([u + x0, v + y0])[own].astype(np.float64))
    return parts


def _neighbours(nodes: Points) -> csr_array:
    """Pixels that touch, by their distance. A diagonal beside a straight way round is no edge of its own."""
    pairs = cKDTree(nodes).query_pairs(1.5, output_type="ndarray")
    step = nodes[pairs[:, 1]] - nodes[pairs[:, 0]]
    index = {(int(x), int(y)): True for x, y in nodes}
    diagonal = np.flatnonzero(np.abs(step).sum(axis=1) == 2)
    redundant = np.zeros(len(pairs), dtype=bool)
    for i in diagonal:
        x, y = (int(n) for n in nodes[pairs[i, 0]])
        dx, dy = (int(n) for n in step[i])
        redundant[i] = (x + dx, y) in index or (x, y + dy) in index
    return _graph(len(nodes), pairs[~redundant], np.hypot(*step[~redundant].T))


def _graph(count: int, pairs: npt.NDArray[np.intp], weights: npt.NDArray[np.float64]) -> csr_array:
    both = np.concatenate([pairs, pairs[:, ::-1]])
    twice = np.concatenate([weights, weights])
    return csr_array(coo_array((twice, (both[:, 0], both[:, 1])), shape=(count, count)))


def _join_gaps(nodes: Points, graph: csr_array, gap_px: float) -> csr_array:
    """The graph with ends of different parts joined, the nearest first, each end once."""
    _, part = connected_components(graph, directed=False)
    ends = np.flatnonzero(np.diff(graph.indptr) == 1)
    if len(ends) < 2 or gap_px <= 0:
        return graph
    pairs = cKDTree(nodes[ends]).query_pairs(gap_px, output_type="ndarray")
    pairs = ends[pairs] if len(pairs) else np.empty((0, 2), dtype=np.intp)
    pairs = pairs[part[pairs[:, 0]] != part[pairs[:, 1]]]
    gaps = np.hypot(*(nodes[pairs[:, 1]] - nodes[pairs[:, 0]]).T)
    outward = {int(end): _outward(nodes, graph, int(end)) for end in np.unique(pairs)}
    used: set[int] = set()
    joined = []
    for n in np.lexsort((pairs[:, 1], pairs[:, 0], gaps)):
        a, b = int(pairs[n, 0]), int(pairs[n, 1])
        across = (nodes[b] - nodes[a]) / gaps[n]
        least = np.cos(np.radians(FORWARD_DEG))
        if a in used or b in used or outward[a] @ across < least or -(outward[b] @ across) < least:
            continue
        used |= {a, b}
        joined.append(n)
    return csr_array(graph + _graph(len(nodes), pairs[joined], gaps[joined]))


def _outward(nodes: Points, graph: csr_array, end: int) -> npt.NDArray[np.float64]:
    """Unit direction in which a skeleton's end points."""
    chain, before = [end], -1
    while len(chain) <= LOOK_BACK_PX:
        following = [
            int(n)
            for n in graph.indices[graph.indptr[chain[-1]] : graph.indptr[chain[-1] + 1]]
            if n != before
        ]
        if len(following) != 1:
            break
        before = chain[-1]
        chain.append(following[0])
    direction = nodes[end] - nodes[chain[-1]]
    return np.asarray(direction / max(float(np.hypot(*direction)), 1e-9))


def _longest_paths(graph: csr_array, least_px: float) -> list[npt.NDArray[np.intp]]:
    """Paths (indices of nodes) of at least `least_px`, each the longest of what the former ones left."""
    found: list[npt.NDArray[np.intp]] = []
    waiting = [np.arange(graph.shape[0])]
    while waiting:
        members = waiting.pop()
        inside = csr_array(graph[members][:, members])
        path, length = _diameter(inside)
        if length < least_px:
            continue
        found.append(members[path])
        left = np.setdiff1d(np.arange(len(members)), path)
        rest = csr_array(inside[left][:, left])
        _, part = connected_components(rest, directed=False)
        steps_px = np.bincount(part, np.asarray(rest.sum(axis=1)).ravel()) / 2
        for some in _members(part):
            if len(some) and steps_px[part[some[0]]] >= least_px:  # no path is longer than all steps
                waiting.append(members[left[some]])
    return found


def _diameter(graph: csr_array) -> tuple[npt.NDArray[np.intp], float]:
    """The longest of the shortest paths of a connected graph, by two searches, and its length."""
    far = int(np.argmax(dijkstra(graph, directed=False, indices=0)))
    distance, before = dijkstra(graph, directed=False, indices=far, return_predecessors=True)
    node = int(np.argmax(distance))
    length = float(distance[node])
    path = [node]
    while node != far:
        node = int(before[node])
        path.append(node)
    return np.asarray(path, dtype=np.intp), length
