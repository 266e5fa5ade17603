"""Coarse placement of all stations in one frame: grown station by station, each placement verified.

Where a station may stand is proposed by what is known of it, best knowledge first: a stated pose, a measured
position (the yaw is searched), the shape of what it saw. A proposal counts only when the coarse clouds agree,
their overlap holds in all directions, no scanner saw through what another one met, and no other place does as
well. So a wrong statement costs a station nothing but time, and cannot sink the others.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from copy import copy
from dataclasses import dataclass

import numpy as np

from tasks.registration import feature_match, plan_search, visibility, world_frame
from tasks.registration.icp import align
from tasks.registration.look_alikes import STATED_M, Fit, least_contradicted, rivals
from tasks.registration.overlap import overlap, share_on
from tasks.registration.rigid_motion import Array, angle_deg, inverse, transform
from tasks.registration.station_cloud import Cloud, balanced_sample, coarse_cloud
from tasks.registration.station_site import Shape, Site
from tasks.registration.yaw_search import DistanceField, turns, turns_about

LEAST_STABILITY = 0.002  # of the overlap's normals; a floor alone has less
STATED_DEG = 45.0  # of a stated heading: nearer to it than to any quarter turn
PROPOSALS = 4  # of each kind that are tried
MOTIONS = 150  # by plan or features, before the least contradictory are chosen
SEARCH_POINTS = 1500
REACH = 4.0  # coarse voxels


@dataclass(frozen=True)
class Placed:
    """The largest connected component; stations by index."""

    T_frame_local: dict[int, Array]  # in the frame of the first of them
    rival_m: dict[int, float]  # of those that fit in more than one place: how far apart


def place(
    sites: Sequence[Site],
    shapes: Sequence[Shape],
    voxel_m: float,
    min_overlap: float,
    on_progress: Callable[[float], None],
) -> Placed:
    left = list(range(len(sites)))
    alone: list[int] = []  # that tied to no single station; several may tell where they stand
    components: list[Placed] = []
    while left:
        grown = _Growing(sites, shapes, voxel_m, min_overlap, left[0])
        waiting = grown.nearest_first(left[1:])
        refused: list[int] = []  # since the component last grew
        while waiting:
            candidate = waiting.pop(0)
            if grown.try_to_add(candidate, [*waiting, *refused]):
                waiting = grown.nearest_first(waiting) + refused + alone
                refused, alone = [], []
                on_progress(len(grown.T) / len(sites))
            else:
                refused.append(candidate)
        components.append(Placed(grown.T, grown.rival_m))
        if len(grown.T) == 1:
            alone.append(left[0])
        left = sorted(refused)
    return max(components, key=lambda placed: len(placed.T_frame_local))


class _Growing:
    """One component while it grows."""

    def __init__(
        self, sites: Sequence[Site], shapes: Sequence[Shape], voxel_m: float, min_overlap: float, first: int
    ) -> None:
        self.sites, self.shapes, self.voxel_m, self.min_overlap = sites, shapes, voxel_m, min_overlap
        self.reach_m = (REACH * voxel_m, 2 * voxel_m, voxel_m)
        self.T = {first: np.eye(4)}
        self.rival_m: dict[int, float] = {}
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

    def try_to_add(self, candidate: int, others: Sequence[int]) -> bool:
        """Place the candidate where it contradicts the placed stations least, if it may stand only there, or
        if of all such places only one lets some of the others stand as they were measured."""
        fits = self._fits(candidate)
        best = least_contradicted(fits)
        self.rival_m.pop(candidate, None)
        if best is None or not best.borne_out:
            return False
        found = rivals(best, fits, self.shapes[candidate].cloud, self.reach_m[0])
        if found:
            vouched = [fit for fit in (best, *found) if self._vouched_for(candidate, fit, others)]
            if len(vouched) != 1:
                self.rival_m[candidate] = min(found.values())
                return False
            best = vouched[0]
        self.T[candidate] = best.T_frame_local
        self._unite()
        return True

    def _vouched_for(self, candidate: int, fit: Fit, others: Sequence[int]) -> bool:
        """Whether another station would stand where it was measured if the candidate stood there. Two
        distances between scanners may agree on either side of a structure; a third tells."""
        if self.T_frame_world is not None or fit.strays > 0:
            return False
        supposed = copy(self)
        supposed.T = self.T | {candidate: fit.T_frame_local}
        supposed._unite()
        if supposed.T_frame_world is None:
            return False
        measured = (other for other in others if self.sites[other].position_m is not None)
        agreeing = (least_contradicted(supposed._fits(other)) for other in measured)
        return any(one is not None and one.strays == 0 for one in agreeing)

    def _fits(self, candidate: int) -> list[Fit]:
        """Where the candidate may stand; by its shape only where it cannot stand as it was stated."""
        sample = balanced_sample(self.shapes[candidate].cloud, SEARCH_POINTS, 0)
        fits: list[Fit] = []
        for kind in (self._by_statement, self._by_plan, self._by_features):
            if any(fit.settled for fit in fits):
                break
            for T in kind(candidate):
                fit = self._fit(candidate, sample, T)
                if fit is not None:
                    fits.append(fit)
        return fits

    def _fit(self, candidate: int, sample: Cloud, T: Array) -> Fit | None:
        """The candidate moved from T to where its sample lies on the placed stations, and what is against
        that; None where too little holds it there."""
        aligned = align(sample, self.union, T, self.reach_m, iterations=10)
        if aligned is None:
            return None
        T = aligned.T_target_source
        found = overlap(self.shapes[candidate].cloud, self.union, T, self.voxel_m)
        if found.share < self.min_overlap or found.stability < LEAST_STABILITY:
            return None
        sights = self._sights(candidate, T)
        seen_through, off_m = visibility.contradiction(sights), self._off_statement_m(candidate, T)
        judged = seen_through is not None or off_m < STATED_M
        share = None if judged else self._share_on(candidate, T)
        return Fit(T, aligned.rmse_m, share, seen_through, visibility.doubt(sights), off_m)

    def _share_on(self, candidate: int, T: Array) -> float:
        """Of the candidate's surfaces and a placed station's together, those that lie on the other's; by the
        station of which it is most."""
        ours, shares = self.shapes[candidate], []
        for i, T_other in self.T.items():
            other, T_other_ours = self.shapes[i], inverse(T_other) @ T
            on = share_on(ours.sample, other.middle, T_other_ours, self.voxel_m)
            back = share_on(other.sample, ours.middle, inverse(T_other_ours), self.voxel_m)
            shares.append((on + back) / 2)
        return max(shares)

    def _by_statement(self, candidate: int) -> Iterator[Array]:
        site = self.sites[candidate]
        if site.prior_T_world_local is not None and self.T_frame_world is not None:
            yield self.T_frame_world @ site.prior_T_world_local
        if site.position_m is not None and site.scanner_m is not None:
            yield from self._turned(site, self.shapes[candidate])

    def _off_statement_m(self, candidate: int, T: Array) -> float:
        """How far from where it was measured the candidate came to stand; infinity where that is not known or
        it faces otherwise than stated. While nothing fixes where the measured world lies, the distances
        between the scanners tell."""
        site, prior = self.sites[candidate], self.sites[candidate].prior_T_world_local
        if prior is not None and self.T_frame_world is not None:
            apart = inverse(self.T_frame_world @ prior) @ T
            if angle_deg(apart) > STATED_DEG:
                return np.inf
            if site.scanner_m is None:
                middle_m = np.median(self.shapes[candidate].cloud.points_m, axis=0)
                return float(np.linalg.norm(transform(apart, middle_m[None])[0] - middle_m))
        if site.position_m is None or site.scanner_m is None:
            return np.inf
        stands_m = transform(T, site.scanner_m[None])[0]
        if self.T_frame_world is not None:
            return float(np.linalg.norm(stands_m - transform(self.T_frame_world, site.position_m[None])[0]))
        off_m = [
            abs(
                float(np.linalg.norm(stands_m - transform(T_other, other.scanner_m[None])[0]))
                - float(np.linalg.norm(site.position_m - other.position_m))
            )
            for other, T_other in ((self.sites[i], T_i) for i, T_i in self.T.items())
            if other.position_m is not None and other.scanner_m is not None
        ]
        return max(off_m, default=np.inf)

    def _turned(self, site: Site, shape: Shape) -> Iterator[Array]:
        """Proposals from the measured position; none where no placed station has one."""
        assert site.position_m is not None and site.scanner_m is not None
        sample_m = balanced_sample(shape.cloud, SEARCH_POINTS, 0).points_m - site.scanner_m
        to_scanner = np.eye(4)
        to_scanner[:3, 3] = -site.scanner_m
        measured = [i for i in self.T if self.sites[i].position_m is not None]
        if self.T_frame_world is not None:
            position_m = transform(self.T_frame_world, site.position_m[None])[0]
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

    def _by_plan(self, candidate: int) -> list[Array]:
        """From the plan, which knows no heights and shifts by cells, each moved to where the clouds meet."""
        cloud = self.shapes[candidate].cloud
        found = plan_search.shifts_and_turns(cloud, self.union, self.voxel_m, MOTIONS)
        sample_m = balanced_sample(cloud, SEARCH_POINTS // 3, 0).points_m.astype(np.float64)
        return self._least_contradicting(candidate, (self.field.settled(T, sample_m) for T in found))

    def _by_features(self, candidate: int) -> list[Array]:
        shape = self.shapes[candidate]
        features = np.concatenate([self.shapes[i].features for i in self.T])
        source, target = feature_match.matches(shape.features, features)
        source_m = shape.cloud.points_m[source].astype(np.float64)
        found = feature_match.motions(source_m, self.united_m[target], self.voxel_m, MOTIONS)
        return self._least_contradicting(candidate, found)

    def _least_contradicting(self, candidate: int, motions: Iterable[Array]) -> list[Array]:
        """Where parts look alike, much may agree on a wrong motion: what was seen through decides. Motions
        that bring too little together do not count."""
        cloud = self.shapes[candidate].cloud

        def meets(T: Array) -> bool:
            return overlap(cloud, self.union, T, 2 * self.voxel_m).share >= self.min_overlap

        def doubt(T: Array) -> float:
            return visibility.doubt(self._sights(candidate, T))

        return sorted(filter(meets, motions), key=doubt)[: 2 * PROPOSALS]

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
        self.T_frame_world = self._frame_of_world()
