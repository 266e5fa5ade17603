"""What the grid of shooting points misses: photos added where a place allows them, useless ones taken out,
and the area that no place allows to see, with the reason."""

import math
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from schemas.camera import Camera
from schemas.settings import PlanSettings
from schemas.surface import Surface
from schemas.vehicle import Vehicle
from tasks.planning.airspace import Airspace
from tasks.planning.coverage import Drawn, Indices, Samples, drawn, seen_by
from tasks.planning.sight import Scene
from tasks.planning.viewpoints import View, aim

Array = npt.NDArray[np.float64]
Flags = npt.NDArray[np.bool_]

ENOUGH = 2  # photos that a place should be in
CLOSER = (1.0, 0.8, 0.64, 0.5)  # shares of the stand-off that are tried for what is missed
TARGET = 0.975  # share of what can be reached in two photos, in 95 of 100 flights with position errors
FEW_DRAWS = 60
AT_ONCE = 2, 0.04  # photos added between two looks at the flights, at least, and as a share
PHOTO_S = 4.0
MOST_ASKED = 600  # missed samples of a surface that views are looked for; each stands for its share
MOST_ADDED = 1.0  # of a surface's photos
SMALLEST_GAIN_M2 = 0.02  # a photo for less of the surface is not worth its stop
NO_WAY = "with no free way there from home"


@dataclass(frozen=True)
class Completed:
    views: tuple[View, ...]
    reachable: Flags  # (N,) of the surface's samples: seen, or some allowed place would show it
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
    views = without_useless(surface, camera, gsd_mm_px, settings, scene, views, samples)
    poses = [view.pose for view in views]
    seen = seen_by(surface, camera, poses, gsd_mm_px, settings.max_incidence_deg, scene, samples)

    def flown(views: tuple[View, ...]) -> Drawn:
        times = PHOTO_S * np.arange(
            len(views), dtype=np.float64
        )  # about; the order of flying is not known yet
        return drawn(
            surface, camera, [v.pose for v in views], times, vehicle, gsd_mm_px, settings.max_incidence_deg,
            scene, reachable, samples, FEW_DRAWS,
        )  # fmt: skip

    reachable = np.ones(len(samples.uv_m), dtype=bool)
    lacking = np.maximum(ENOUGH - seen.photos, 0).astype(float)
    missed = np.flatnonzero((lacking > 0) | (flown(views).lacking > 0))
    asked = (
        missed[np.unique(np.linspace(0, len(missed) - 1, MOST_ASKED).astype(int))] if len(missed) else missed
    )
    candidates, refused = _candidates(
        surface, vehicle, stand_off_m, settings, airspace, scene, samples.points_m[asked], connected
    )
    known = np.zeros(len(samples.uv_m), dtype=bool)
    known[asked[sorted({n for n, _ in candidates})]] = True
    reachable = (seen.photos > 0) | known
    never = np.flatnonzero(~reachable)
    share = samples.cell_m**2 * len(missed) / max(len(asked), 1)
    areas: dict[str, float] = {}
    for number, reason in refused.items():
        if not reachable[asked[number]]:
            areas[reason] = areas.get(reason, 0.0) + share
    if len(asked) < len(missed):  # a missed sample that was not asked goes with the nearest that was
        order = np.searchsorted(asked, never).clip(0, len(asked) - 1)
        reachable[never] = known[asked[order]]

    different = list({view.pose: view for view in candidates.values()}.values())
    most = len(views) + max(4, math.ceil(MOST_ADDED * len(views)))
    if different and reachable.any():
        error = vehicle.position_error_m / stand_off_m
        surely = _inner_frame(camera, vehicle.sideways_error_m / stand_off_m * camera.focal_px)
        shown = seen_by(
            surface, surely, [v.pose for v in different], gsd_mm_px / (1 + error), settings.max_incidence_deg,
            scene, samples,
        ).shown  # fmt: skip
        at_once = max(AT_ONCE[0], round(AT_ONCE[1] * len(views)))
        least = SMALLEST_GAIN_M2 / samples.cell_m**2
        lacking[~reachable] = 0.0
        taken: set[int] = set()
        views = (*views, *_best(different, shown, taken, lacking, most - len(views), least))
        while len(views) < most:  # as if flown, until the worst flights are good enough
            errs = flown(views)
            if np.quantile(errs.twice, 0.05) >= TARGET:
                break
            few = min(at_once, most - len(views))
            more = _best(different, shown, taken, errs.lacking * reachable, few, least)
            if not more:
                break
            views = (*views, *more)
    return Completed(views, reachable, dict(sorted(areas.items())))


def _best(
    different: list[View], shown: Sequence[Indices], taken: set[int], lacking: Array, most: int, least: float
) -> list[View]:
    """Up to `most` views, always the one next that shows most of what is lacking; a photo gives each sample
    one. `taken`: numbers of those chosen before; the new ones join them."""
    lacking = lacking.copy()
    chosen: list[View] = []
    while len(chosen) < most:
        gains = [0.0 if k in taken else float(lacking[s].sum()) for k, s in enumerate(shown)]
        best = int(np.argmax(gains))
        if gains[best] <= least:
            break
        chosen.append(different[best])
        lacking[shown[best]] = np.maximum(lacking[shown[best]] - 1.0, 0.0)
        taken.add(best)
    return chosen


def without_useless(
    surface: Surface,
    camera: Camera,
    gsd_mm_px: float,
    settings: PlanSettings,
    scene: Scene,
    views: tuple[View, ...],
    samples: Samples,
) -> tuple[View, ...]:
    """The views but those that add no coverage: oblique ones whose every sample at least two others show.
    The perpendicular grid stays whole, since stitching needs its overlap."""
    if not any(view.incidence_deg > 0 for view in views):
        return views
    poses = [view.pose for view in views]
    shown = seen_by(surface, camera, poses, gsd_mm_px, settings.max_incidence_deg, scene, samples).shown
    photos: Counter[int] = Counter(s for each in shown for s in each.tolist())
    kept = list(range(len(views)))
    for number in sorted(kept, key=lambda n: -views[n].incidence_deg):
        own = shown[number].tolist()
        if views[number].incidence_deg > 0 and all(photos[s] > ENOUGH for s in own):
            photos.subtract(own)
            kept.remove(number)
    return tuple(views[n] for n in kept)


def _candidates(
    surface: Surface,
    vehicle: Vehicle,
    stand_off_m: float,
    settings: PlanSettings,
    airspace: Airspace,
    scene: Scene,
    points_m: Array,
    connected: Callable[[Array], Flags],
) -> tuple[dict[tuple[int, float], View], dict[int, str]]:
    """Views of each point (M, 3) that some allowed place shows, by its number and the share of the stand-off;
    for the others why not. Oblique views are looked for closer by too: the pixels of their far half grow."""
    found: dict[tuple[int, float], View] = {}
    refused: dict[int, str] = {}
    left = np.arange(len(points_m))
    for share in CLOSER:
        distance = share * stand_off_m
        if not left.size or distance < vehicle.inflation_m:
            break
        points = points_m[left]
        aimed = aim(surface, vehicle, distance, points, points, settings.max_incidence_deg, airspace, scene)
        for n, reason in aimed.refused.items():
            refused.setdefault(int(left[n]), reason)
        numbers = list(aimed.found)
        ways = connected(np.array([aimed.found[n][0].position_m for n in numbers]).reshape(-1, 3))
        square: set[int] = set()
        for n, way in zip(numbers, ways, strict=True):
            i = int(left[n])
            if way:
                found[i, share] = View(surface.name, 0, 0, points_m[i], *aimed.found[n])
                refused.pop(i, None)
                if found[i, share].incidence_deg == 0.0:
                    square.add(i)
            elif (i, CLOSER[0]) not in found:
                refused[i] = NO_WAY
        left = np.array([i for i in left.tolist() if i not in square], dtype=np.int64)
    return found, refused


def _inner_frame(camera: Camera, margin_px: float) -> Camera:
    """The middle of the camera's frame, which is shown however the position errs."""
    margin = math.ceil(min(margin_px, 0.4 * min(camera.width_px, camera.height_px)))
    cx, cy = camera.principal_px
    return camera.model_copy(
        update={
            "width_px": camera.width_px - 2 * margin,
            "height_px": camera.height_px - 2 * margin,
            "cx_px": cx - margin,
            "cy_px": cy - margin,
        }
    )
