"""What a plan proves of each surface before take-off: how much of it is seen at the asked size of pixels and
angle, flown exactly and with the vehicle's position error, and which crack width can be measured where."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from schemas.camera import Camera
from schemas.contract import Vector3
from schemas.flight_plan import Flight, SurfaceCoverage, Waypoint
from schemas.surface import Surface
from schemas.vehicle import Vehicle
from tasks.planning.completing import Completed
from tasks.planning.coverage import Samples, drawn, reasons, seen_by
from tasks.planning.sight import Scene
from tasks.planning.timing import shot_times_s

Array = npt.NDArray[np.float64]

BETWEEN_FLIGHTS_S = 3600.0  # long enough for the slow part of the position error to be another one
MEASURED_PX = 3.0  # a crack must be this many pixels wide to be measured


@dataclass(frozen=True)
class WidthMap:
    """Raster of a surface, row 0 at its top (largest v), column 0 at its smallest u."""

    surface: str
    cell_m: float
    width_mm: npt.NDArray[np.float32]  # (H, W) smallest measurable, NaN off the surface and where unseen


@dataclass(frozen=True)
class Proof:
    coverage: SurfaceCoverage
    widths: WidthMap


def times_of_photos(
    waypoints: Sequence[Waypoint],
    flights: Sequence[Flight],
    home_m: Vector3,
    vehicle: Vehicle,
    camera: Camera,
) -> dict[str, float]:
    """Seconds at which each photo is taken, batteries changed between flights."""
    times: dict[str, float] = {}
    for number, flight in enumerate(flights):
        own = waypoints[flight.first : flight.last + 1]
        taken, _ = shot_times_s(home_m, own, vehicle, camera)
        names = [w.photo for w in own if w.kind == "shooting"]
        times |= {
            name: number * BETWEEN_FLIGHTS_S + float(at)
            for name, at in zip(names, taken, strict=True)
            if name is not None
        }
    return times


def prove(
    surface: Surface,
    camera: Camera,
    vehicle: Vehicle,
    waypoints: Sequence[Waypoint],
    times_s: dict[str, float],
    stand_off_m: float,
    gsd_mm_px: float,
    max_incidence_deg: float,
    scene: Scene,
    completed: Completed,
    samples: Samples,
) -> Proof:
    """By casting rays from the planned poses, and from 200 flights whose positions err (`coverage.drawn`)."""
    own = [w for w in waypoints if w.surface == surface.name]
    poses = [w.pose for w in own]
    seen = seen_by(surface, camera, poses, gsd_mm_px, max_incidence_deg, scene, samples)
    reachable = completed.reachable
    times = np.array([times_s[w.photo] for w in own if w.photo is not None])
    flown = drawn(
        surface, camera, poses, times, vehicle, gsd_mm_px, max_incidence_deg, scene, reachable, samples
    )
    width_mm = MEASURED_PX * flown.mm_px
    within = np.sort(width_mm[reachable])
    measurable = float(within[int(np.ceil(0.95 * len(within))) - 1]) if len(within) else np.inf
    coverage = SurfaceCoverage(
        surface=surface.name,
        area_m2=surface.area_m2,
        covered=round(seen.covered, 5),
        stand_off_m=round(stand_off_m, 4),
        gsd_mm_px=round(camera.gsd_mm_px(stand_off_m), 5),
        photos=len(poses),
        not_reached=reasons(seen, completed.unreachable_m2, reachable),
        reachable=round(float(reachable.mean()), 5) if reachable.any() else 0.0,
        twice=round(float((seen.photos[reachable] >= 2).mean()), 5) if reachable.any() else 0.0,
        twice_median=round(float(np.median(flown.twice)), 5) if reachable.any() else 0.0,
        twice_p05=round(float(np.quantile(flown.twice, 0.05)), 5) if reachable.any() else 0.0,
        measurable_mm=round(measurable, 3) if np.isfinite(measurable) else None,
    )
    return Proof(coverage, _raster(surface, samples, width_mm))


def _raster(surface: Surface, samples: Samples, width_mm: Array) -> WidthMap:
    u_low, v_low, u_high, v_high = surface.bounds_m
    cell = samples.cell_m
    columns = np.floor((samples.uv_m[:, 0] - u_low) / cell).astype(np.int64)
    rows = np.floor((samples.uv_m[:, 1] - v_low) / cell).astype(np.int64)
    height, width = (max(1, int(np.ceil((b - a) / cell))) for a, b in ((v_low, v_high), (u_low, u_high)))
    raster = np.full((height, width), np.nan, dtype=np.float32)
    raster[height - 1 - rows.clip(0, height - 1), columns.clip(0, width - 1)] = np.where(
        np.isfinite(width_mm), width_mm, np.nan
    )
    return WidthMap(surface.name, cell, raster)
