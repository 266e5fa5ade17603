"""What the grid of shooting points misses: photos added where a place allows them, useless ones taken out,
and the area that no place allows to see, with the reason.

What is missed is asked of flights that are flown exactly, or off by the position error's bound along one
axis: each of these is to show every place twice. What no allowed place shows in one of them is out of reach.
"""

import heapq
import math
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

from schemas.camera import Camera
from schemas.settings import PlanSettings
from schemas.surface import Surface
from schemas.vehicle import Vehicle
from tasks.planning.airspace import Airspace
from tasks.planning.coverage import Drawn, Indices, Samples, drawn, off_course_m, seen_off_course
from tasks.planning.sight import Scene
from tasks.planning.timing import shooting_s, travel_s
from tasks.planning.viewpoints import View, aim

Array = npt.NDArray[np.float64]
Flags = npt.NDArray[np.bool_]

ENOUGH = 2  # photos that a place should be in
CLOSER = (1.0, 0.8, 0.64, 0.5)  # shares of the stand-off that are tried for what is missed
TARGET = 0.98  # share of what can be reached in two photos, in 95 of 100 flights with position errors
FEW_DRAWS = 100
AT_ONCE = 2, 0.04  # photos added between two looks at the flights, at least, and as a share
MOST_ASKED = 600  # missed samples of a surface that views are looked for; each stands for its share
MOST_ADDED = 3.0  # of a surface's photos
SMALLEST_GAIN_M2 = 0.02  # a photo for less of the surface is not worth its stop
NO_WAY = "with no free way there from home"
HIDDEN = "hidden behind something"


@dataclass(frozen=True)
class Completed:
    views: tuple[View, ...]
    reachable: Flags  # (N,) of the surface's samples: allowed places show it, wherever the position errs
    unreachable_m2: dict[str, float]  # by reason


def complete(
    surface: Surface,
    camera: Camera,
    vehicle: Vehicle,
    stand_off_m: float,
    gsd_mm_px: float,
    settings: PlanSettings,
    airspace: Airspace,
    scene: Scene,
    views: tuple[View, ...],
    connected: Callable[[Array], Flags],
    samples: Samples,
) -> Completed:
    """connected: whether a way leads from home to each of (M, 3) free places."""
    count = len(samples.uv_m)
    off_m = off_course_m(surface, vehicle)

    def shown_by(views: Sequence[View]) -> tuple[Indices, ...]:
        poses = [view.pose for view in views]
        return seen_off_course(
            surface, camera, poses, vehicle, gsd_mm_px, settings.max_incidence_deg, scene, samples
        )

    def flown(views: Sequence[View]) -> Drawn:
        poses = [view.pose for view in views]
        times = _times_s(views, of_the_grid, vehicle, camera)
        return drawn(
            surface, camera, poses, times, vehicle, gsd_mm_px, settings.max_incidence_deg, scene, reachable,
            samples, FEW_DRAWS,
        )  # fmt: skip

    shown = shown_by(views)
    views, shown = without_useless(views, shown)
    of_the_grid = len(views)
    photos = _photos(shown, len(off_m) * count)
    lacking = np.maximum(ENOUGH - photos, 0).astype(float)
    missed = np.flatnonzero(lacking)
    asked = missed
    if len(missed) > MOST_ASKED:
        asked = missed[np.linspace(0, len(missed) - 1, MOST_ASKED).astype(int)]
    points = samples.points_m[asked % count]
    normal = np.asarray(surface.plane.normal)
    astray = off_m[asked // count]
    targets = points - astray + (astray @ normal)[:, None] * normal
    candidates, refused = _candidates(
        surface, vehicle, stand_off_m, settings, airspace, scene, targets, points, connected
    )
    shows = shown_by(candidates)
    within_reach = (photos + _photos(shows, len(photos)) > 0).reshape(len(off_m), count)
    reachable: Flags = np.asarray(within_reach.all(axis=0))
    areas = _areas_m2(reachable, within_reach[0], asked % count, refused, samples, vehicle)

    most = len(views) + max(4, math.ceil(MOST_ADDED * len(views)))
    least = SMALLEST_GAIN_M2 / samples.cell_m**2
    lacking *= np.tile(reachable, len(off_m))
    taken: set[int] = set()
    if candidates and lacking.any():
        views = (*views, *_best(candidates, shows, taken, lacking, most - len(views), least))
        at_once = max(AT_ONCE[0], round(AT_ONCE[1] * len(views)))
        while len(views) < most:  # as if flown, until the worst flights are good enough
            errs = flown(views)
            if np.quantile(errs.twice, 0.05) >= TARGET:
                break
            few = min(at_once, most - len(views))
            weights = np.tile(errs.lacking * reachable, len(off_m))
            more = _best(candidates, shows, taken, weights, few, least)
            if not more:
                break
            views = (*views, *more)
    return Completed(views, reachable, areas)


def _photos(shown: Sequence[Indices], count: int) -> npt.NDArray[np.int64]:
    """(count,) photos that show each number."""
    numbers = np.concatenate([*shown, np.empty(0, dtype=np.int64)])
    return np.bincount(numbers, minlength=count)


def _times_s(views: Sequence[View], of_the_grid: int, vehicle: Vehicle, camera: Camera) -> Array:
    """(P,) about when each photo is taken, the order of flying not being known yet: the grid's one after the
    other, those added beside the nearest of these."""
    places = np.array([view.pose.position_m for view in views])
    ordered = places[: max(of_the_grid, 1)]
    legs = travel_s(np.linalg.norm(np.diff(ordered, axis=0), axis=1), vehicle)
    times = np.concatenate([[0.0], np.cumsum(legs + shooting_s(0.0, 0.0, vehicle, camera))])
    return np.asarray(times[cKDTree(ordered).query(places)[1]])


def _areas_m2(
    reachable: Flags,
    exactly: Flags,
    asked: Indices,
    refused: dict[int, str],
    samples: Samples,
    vehicle: Vehicle,
) -> dict[str, float]:
    """What is out of reach by reason: that of the nearest sample asked for which no place was found at all,
    or the position error where an exact flight would show it. exactly: (N,) of the samples."""
    wanders = f"surely seen from no place while the position may err by {vehicle.sideways_error_m:.2f} m"
    never = np.flatnonzero(~reachable)
    why = np.array([wanders] * len(never), dtype=object)
    blind = ~exactly[never]
    if refused and blind.any():
        numbers = np.array(sorted(refused))
        nearest = cKDTree(samples.uv_m[asked[numbers]]).query(samples.uv_m[never[blind]])[1]
        why[blind] = [refused[int(n)] for n in numbers[nearest]]
    elif blind.any():
        why[blind] = HIDDEN
    return {reason: n * samples.cell_m**2 for reason, n in sorted(Counter(why).items())}


def _best(
    candidates: Sequence[View],
    shown: Sequence[Indices],
    taken: set[int],
    lacking: Array,
    most: int,
    least: float,
) -> list[View]:
    """Up to `most` views, always the one next that shows most of what is lacking; a photo gives each sample
    one. `taken`: numbers of those chosen before; the new ones join them. A view's gain only falls as others
    are chosen, so that only those at the top of the heap are counted again."""
    lacking = lacking.copy()
    heap = [(-float(lacking[s].sum()), k) for k, s in enumerate(shown) if k not in taken]
    heapq.heapify(heap)
    chosen: list[View] = []
    while heap and len(chosen) < most:
        _, k = heapq.heappop(heap)
        gain = float(lacking[shown[k]].sum())
        if gain <= least:
            continue
        if heap and gain < -heap[0][0]:
            heapq.heappush(heap, (-gain, k))
            continue
        chosen.append(candidates[k])
        lacking[shown[k]] = np.maximum(lacking[shown[k]] - 1.0, 0.0)
        taken.add(k)
    return chosen


def without_useless(
    views: tuple[View, ...], shown: tuple[Indices, ...]
) -> tuple[tuple[View, ...], tuple[Indices, ...]]:
    """The views, and what they show, but those that add no coverage: oblique ones whose every sample at least
    two others show. The perpendicular grid stays whole, since stitching needs its overlap."""
    photos = _photos(shown, max((int(s.max()) for s in shown if s.size), default=-1) + 1)
    kept = list(range(len(views)))
    for number in sorted(kept, key=lambda n: -views[n].incidence_deg):
        if views[number].incidence_deg > 0 and (photos[shown[number]] > ENOUGH).all():
            photos[shown[number]] -= 1
            kept.remove(number)
    return tuple(views[n] for n in kept), tuple(shown[n] for n in kept)


def _candidates(
    surface: Surface,
    vehicle: Vehicle,
    stand_off_m: float,
    settings: PlanSettings,
    airspace: Airspace,
    scene: Scene,
    targets_m: Array,
    points_m: Array,
    connected: Callable[[Array], Flags],
) -> tuple[list[View], dict[int, str]]:
    """Views towards the targets (M, 3) that see the points (M, 3), where an allowed place gives one; by
    number why there is none. Obliques are looked for closer by too: the pixels of their far half grow."""
    found: dict[tuple[int, float], View] = {}
    refused: dict[int, str] = {}
    left = np.arange(len(points_m))
    for share in CLOSER:
        distance = share * stand_off_m
        if not left.size or distance < vehicle.inflation_m:
            break
        aimed = aim(
            surface, vehicle, distance, targets_m[left], points_m[left], settings.max_incidence_deg, airspace,
            scene,
        )  # fmt: skip
        for n, reason in aimed.refused.items():
            refused.setdefault(int(left[n]), reason)
        numbers = list(aimed.found)
        ways = connected(np.array([aimed.found[n][0].position_m for n in numbers]).reshape(-1, 3))
        square: set[int] = set()
        for n, way in zip(numbers, ways, strict=True):
            i = int(left[n])
            if way:
                found[i, share] = View(surface.name, 0, 0, targets_m[i], *aimed.found[n])
                refused.pop(i, None)
                if found[i, share].incidence_deg == 0.0:
                    square.add(i)
            elif (i, CLOSER[0]) not in found:
                refused[i] = NO_WAY
        left = np.array([i for i in left.tolist() if i not in square], dtype=np.int64)
    return list({view.pose: view for view in found.values()}.values()), refused
