"""Coarse placement of all stations in one frame: grown station by station, each placement verified.

Where a station may stand is proposed by what is known of it, best knowledge first: a stated pose, a measured
position (the yaw is searched), the shape of what it saw. A proposal counts only when the coarse clouds agree,
their overlap holds in all directions, and no scanner saw through what another one met. So a wrong statement
costs a station nothing but time, and cannot sink the others.
"""

from collections.abc import Callable, Iterator, Sequence

import numpy as np

from tasks.registration import feature_match, plan_search, visibility, world_frame
from tasks.registration.icp import align
from tasks.registration.overlap import overlap
from tasks.registration.rigid_motion import Array, inverse, transform
from tasks.registration.station_cloud import Cloud, balanced_sample, coarse_cloud
from tasks.registration.station_site import Shape, Site
from tasks.registration.yaw_search import DistanceField, turns, turns_about

LEAST_STABILITY = 0.002  # of the overlap's normals; a floor alone has less
MOST_SEEN_THROUGH = 0.13  # see visibility.contradiction
MOST_AS_STATED = 0.3  # where it came to stand as it was measured: traffic between scans, not a wrong place
STATED_M = 2.0  # around a measured position a station is looked for, and found there as it was measured
SURELY_RIGHT = 0.03  # no better proposal is looked for
PROPOSALS = 4  # of each kind that are tried
MOTIONS = 150  # by plan or features, before the least contradictory are chosen
SEARCH_POINTS = 1500
REACH = 4.0  # coarse voxels


def place(
    sites: Sequence[Site],
    shapes: Sequence[Shape],
    voxel_m: float,
    min_overlap: float,
    on_progress: Callable[[float], None],
) -> dict[int, Array]:
    """T_frame_local of the largest connected component's stations, by index, in the frame of the first."""
    left = list(range(len(sites)))
    components: list[dict[int, Array]] = []
    while left:
        grown = _Growing(sites, shapes, voxel_m, min_overlap, left[0])
        waiting = grown.nearest_first(left[1:])
        refused: list[int] = []  # since the component last grew
        while waiting:
            candidate = waiting.pop(0)
            if grown.try_to_add(candidate):
                waiting = grown.nearest_first(waiting) + refused
                refused = []
                on_progress(len(grown.T) / len(sites))
            else:
                refused.append(candidate)
        components.append(grown.T)
        left = sorted(refused)
    return max(components, key=len)


class _Growing:
    """One component while it grows."""

    def __init__(
        self, sites: Sequence[Site], shapes: Sequence[Shape], voxel_m: float, min_overlap: float, first: int
    ) -> None:
        self.sites, self.shapes, self.voxel_m, self.min_overlap = sites, shapes, voxel_m, min_overlap
        self.reach_m = (REACH * voxel_m, 2 * voxel_m, voxel_m)
        self.T = {first: np.eye(4)}
        self._unite()

    def nearest_first(self, waiting: Sequence[int]) -> list[int]:
        """Stations measured near the placed ones are likely to overlap them."""
        near = [self.sites[i].position_m for i in self.T]
        known = np.array([p for p in near if p is not None])

        def distance_m(i: int) -> float:
            position = self.sites[i].position_m
            if position is None or len(known) == 0:
                return np.inf
            return float(np.linalg.norm(known - position, axis=1).min())

        return sorted(waiting, key=lambda i: (distance_m(i), i))

    def try_to_add(self, candidate: int) -> bool:
        """Place the candidate where it contradicts the placed stations least, if it may stand there."""
        best: tuple[float, Array] | None = None
        sample = balanced_sample(self.shapes[candidate].cloud, SEARCH_POINTS, 0)
        for T, stated in self._proposals(candidate):
            settled = best is not None and best[0] < MOST_SEEN_THROUGH and self._as_stated(candidate, best[1])
            if settled and not stated:
                break
            aligned = align(sample, self.union, T, self.reach_m, iterations=10)
            if aligned is None:
                continue
            T = aligned.T_target_source
            found = overlap(self.shapes[candidate].cloud, self.union, T, self.voxel_m)
            if found.share < self.min_overlap or found.stability < LEAST_STABILITY:
                continue
            seen_through = self._contradiction(candidate, T)
            most = MOST_AS_STATED if stated and self._as_stated(candidate, T) else MOST_SEEN_THROUGH
            if seen_through < most and (best is None or seen_through < best[0]):
                best = seen_through, T
            if seen_through < SURELY_RIGHT:
                break
        if best is None:
            return False
        self.T[candidate] = best[1]
        self._unite()
        return True

    def _as_stated(self, candidate: int, T: Array) -> bool:
        """Whether the candidate came to stand where it was measured."""
        site, T_frame_world = self.sites[candidate], self._frame_of_world()
        if site.position_m is None or site.scanner_m is None or T_frame_world is None:
            return False
        apart_m = transform(T, site.scanner_m[None])[0] - transform(T_frame_world, site.position_m[None])[0]
        return bool(np.linalg.norm(apart_m) < STATED_M)

    def _proposals(self, candidate: int) -> Iterator[tuple[Array, bool]]:
        """T_frame_local, and whether it stands on a statement."""
        site, shape = self.sites[candidate], self.shapes[candidate]
        T_frame_world = self._frame_of_world()
        if site.prior_T_world_local is not None and T_frame_world is not None:
            yield T_frame_world @ site.prior_T_world_local, True
        if site.position_m is not None and site.scanner_m is not None:
            for T in self._turned(site, shape, T_frame_world):
                yield T, True
        for search in (self._by_plan, self._by_features):
            for T in self._least_contradicting(candidate, search(shape)):
                yield T, False

    def _turned(self, site: Site, shape: Shape, T_frame_world: Array | None) -> Iterator[Array]:
        """Proposals from the measured position; none where no placed station has one."""
        assert site.position_m is not None and site.scanner_m is not None
        sample_m = balanced_sample(shape.cloud, SEARCH_POINTS, 0).points_m - site.scanner_m
        to_scanner = np.eye(4)
        to_scanner[:3, 3] = -site.scanner_m
        measured = [i for i in self.T if self.sites[i].position_m is not None]
        if T_frame_world is not None:
            position_m = transform(T_frame_world, site.position_m[None])[0]
            for _, T in turns(self.field, sample_m.astype(np.float64), position_m, STATED_M, PROPOSALS):
                yield T @ to_scanner
        elif measured:
            anchor = self.sites[measured[0]]
            assert anchor.position_m is not None
            if anchor.scanner_m is None:
                return
            anchor_m = transform(self.T[measured[0]], anchor.scanner_m[None])[0]
            about = DistanceField(
                self.field.low_m - anchor_m, self.field.cell_m, self.field.reach_m, self.field.distance_m
            )
            baseline_m = site.position_m - anchor.position_m
            few_m = sample_m[::2].astype(np.float64)
            for _, T in turns_about(about, few_m, baseline_m, 4.0, 2 * PROPOSALS):
                T[:3, 3] += anchor_m
                yield T @ to_scanner

    def _by_plan(self, shape: Shape) -> list[Array]:
        """From the plan, which knows no heights and shifts by cells, each moved to where the clouds meet."""
        found = plan_search.shifts_and_turns(shape.cloud, self.union, self.voxel_m, MOTIONS)
        sample_m = balanced_sample(shape.cloud, SEARCH_POINTS // 3, 0).points_m.astype(np.float64)
        return [self.field.settled(T, sample_m) for T in found]

    def _by_features(self, shape: Shape) -> list[Array]:
        features = np.concatenate([self.shapes[i].features for i in self.T])
        source, target = feature_match.matches(shape.features, features)
        source_m = shape.cloud.points_m[source].astype(np.float64)
        return feature_match.motions(source_m, self.united_m[target], self.voxel_m, MOTIONS)

    def _least_contradicting(self, candidate: int, motions: list[Array]) -> list[Array]:
        """Where parts look alike, much may agree on a wrong motion: what was seen through decides. Motions
        that bring too little together do not count."""
        cloud = self.shapes[candidate].cloud

        def meets(T: Array) -> bool:
            return overlap(cloud, self.union, T, 2 * self.voxel_m).share >= self.min_overlap

        def doubt(T: Array) -> float:
            return visibility.doubt(self._sights(candidate, T))

        return sorted(filter(meets, motions), key=doubt)[: 2 * PROPOSALS]

    def _contradiction(self, candidate: int, T: Array) -> float:
        return visibility.contradiction(self._sights(candidate, T))

    def _sights(self, candidate: int, T: Array) -> list[tuple[float, float]]:
        """Of all placed stations: people and cars weigh little in what many saw."""
        shape = self.shapes[candidate]
        sights = []
        for other, T_other in self.T.items():
            T_other_candidate = inverse(T_other) @ T
            sights.append(
                visibility.sight(
                    shape.cloud,
                    self.shapes[other].cloud,
                    shape.image,
                    self.shapes[other].image,
                    T_other_candidate,
                    inverse(T_other_candidate),
                )
            )
        return sights

    def _frame_of_world(self) -> Array | None:
        """Where the world of the statements lies in the component's frame, once that is known."""
        T_world_frame = world_frame.fit(
            [self.T[i] for i in self.T],
            [self.sites[i].prior_T_world_local for i in self.T],
            [self.sites[i].scanner_m for i in self.T],
            [self.sites[i].position_m for i in self.T],
        )
        return None if T_world_frame is None else inverse(T_world_frame)

    def _unite(self) -> None:
        """The placed stations as one coarse cloud, with its features and its distance field."""
        points, normals = [], []
        for i, T in self.T.items():
            cloud = self.shapes[i].cloud
            points.append(transform(T, cloud.points_m))
            normals.append(cloud.normals @ T[:3, :3].T)
        self.united_m = np.concatenate(points)
        both = Cloud(self.united_m.astype(np.float32), np.concatenate(normals).astype(np.float32))
        self.union = coarse_cloud(both, self.voxel_m)
        self.field = DistanceField.of(self.union.points_m, self.voxel_m, REACH * self.voxel_m)
