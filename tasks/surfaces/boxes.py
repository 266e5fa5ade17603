"""Boxes along the axes: what is far apart is told apart before anything is computed of it."""

from dataclasses import dataclass

import numpy as np

from tasks.surfaces.cloud import Floats, Indices


@dataclass(frozen=True)
class Box:
    low: Floats  # (3,)
    high: Floats  # (3,)

    @classmethod
    def of(cls, points_m: Floats) -> "Box":
        return cls(points_m.min(axis=0), points_m.max(axis=0))

    def grown(self, margin_m: float | Floats) -> "Box":
        return Box(self.low - margin_m, self.high + margin_m)

    def meets(self, other: "Box") -> bool:
        return bool((self.low <= other.high).all() and (self.high >= other.low).all())


class Sorted:
    """Points in order along the axis on which they spread the farthest."""

    def __init__(self, points_m: Floats) -> None:
        self.axis = int(np.ptp(points_m, axis=0).argmax()) if len(points_m) else 0
        self.order = np.argsort(points_m[:, self.axis], kind="stable")
        self.points_m = points_m[self.order]

    def inside(self, box: Box) -> Indices:
        """Indices of the points in the box, as they were given, ascending."""
        return np.sort(self.order[self.at(box)])

    def at(self, box: Box) -> Indices:
        """Places in `points_m` of the points in the box."""
        along = self.points_m[:, self.axis]
        first = int(np.searchsorted(along, box.low[self.axis], "left"))
        end = int(np.searchsorted(along, box.high[self.axis], "right"))
        part = self.points_m[first:end]
        within = ((part >= box.low) & (part <= box.high)).all(axis=1)
        return first + np.flatnonzero(within)
