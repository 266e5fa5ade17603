"""Matches of pairs joined into tracks: one point of the plane, seen in several photos."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from tasks.stitching.pairs import Edge, PhotoFeatures
from tasks.stitching.view import Array

Index = npt.NDArray[np.int64]

SAME_PX = 1.0  # SIFT gives a point with two orientations two features


@dataclass(frozen=True)
class Observations:
    photo: Index  # (M,)
    track: Index  # (M,) 0..tracks−1, sorted
    xy: Array  # (M, 2) undistorted pixels under the photo's own camera

    @property
    def tracks(self) -> int:
        return int(self.track[-1]) + 1 if len(self.track) else 0

    def where(self, keep: npt.NDArray[np.bool_]) -> "Observations":
        """Those kept, without the tracks that are then seen only once."""
        often = np.bincount(self.track[keep], minlength=self.tracks) >= 2
        keep = keep & often[self.track]
        _, track = np.unique(self.track[keep], return_inverse=True)
        return Observations(self.photo[keep], track.astype(np.int64), self.xy[keep])


def build_tracks(edges: Sequence[Edge], features: Sequence[PhotoFeatures]) -> Observations:
    """A track that claims two places in one photo is false somewhere, and dropped."""
    start = np.concatenate([[0], np.cumsum([len(f.xy) for f in features])]).astype(np.int64)
    if not edges:
        return Observations(np.zeros(0, np.int64), np.zeros(0, np.int64), np.zeros((0, 2)))
    a = np.concatenate([start[e.a] + e.matches[:, 0] for e in edges])
    b = np.concatenate([start[e.b] + e.matches[:, 1] for e in edges])
    nodes, inverse = np.unique(np.concatenate([a, b]), return_inverse=True)
    pairs = inverse.reshape(2, -1)
    graph = coo_matrix((np.ones(len(a)), (pairs[0], pairs[1])), shape=(len(nodes), len(nodes)))
    _, label = connected_components(graph, directed=False)
    photo = np.searchsorted(start, nodes, side="right") - 1
    xy = np.concatenate([f.xy for f in features])[nodes].astype(np.float64)
    order = np.lexsort((nodes, photo, label))
    label, photo, xy = label[order].astype(np.int64), photo[order], xy[order]
    repeats = np.zeros(len(label), bool)
    repeats[1:] = (label[1:] == label[:-1]) & (photo[1:] == photo[:-1])
    far = repeats.copy()
    far[1:] &= np.linalg.norm(xy[1:] - xy[:-1], axis=1) > SAME_PX
    contradictory = np.zeros(label.max() + 1, bool)
    contradictory[label[far]] = True
    return Observations(photo, label, xy).where(~repeats & ~contradictory[label])
