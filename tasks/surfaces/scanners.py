"""Which stated scanner positions can be believed, and where a scanner looked.

A scanner sees no two surfaces in one direction. Where it has no echo it may have seen the sky, or not have
looked: many scans are of a window alone, and none sees through its own tripod.
"""

import numpy as np
import numpy.typing as npt

from schemas.scan_window import ScanWindow
from tasks.surfaces.cloud import Cloud, unit

Floats = npt.NDArray[np.float64]

BIN_DEG = 0.5
DEEPER = 1.15  # farther than the nearest point of its direction by this factor, and by LEAST_M, is behind it:
LEAST_M = 0.3  # flat ground seen at a grazing angle is not
OF_ONE_VIEW = 1e-12  # views are computed alike; normals, which stand for views not known, are never so near
MOST_HIDDEN = 0.05  # of a station's own points: edges and leaves make up to 2 %, false places 9 % and more
WIDEST_GAP_DEG = 15  # without any echo: water, glass or a road to the horizon; wider, nobody looked
STOPS_DEG = (5.0, 85.0)  # highest echoes alike below are the horizon's, above the zenith's
STRAY = 0.02  # share of the circle where an echo from above a head's stop is a bird's
ALIKE_DEG = 0.5  # that the highest echoes of a head that turns no further differ by
MANY = 90  # degrees of the circle: no roof's edge is so high all along
SOME, UNEVEN = 12, 1.5  # so many, where things this many times as far as others end there alike


def scanners(cloud: Cloud, scanners_m: Floats) -> tuple[Floats, tuple[ScanWindow, ...]]:
    """(K, 3) of the scanners (S, 3), NaN where not known, those from which their points can have been seen;
    and where each looked.

    The origin of a cloud that was merged elsewhere, or that moved while it scanned, is no scanner's place.
    What was free can only be told from a true one."""
    believed, windows = [], []
    for station in scanners_m[~np.isnan(scanners_m).any(axis=1)]:
        towards = unit(station - cloud.points)
        own = np.einsum("ni,ni->n", towards, cloud.views) > 1 - OF_ONE_VIEW
        if own.any() and hidden_share(cloud.points[own] - station) <= MOST_HIDDEN:
            believed.append(station)
            windows.append(window(cloud.points[own] - station))
    return np.array(believed).reshape(-1, 3), tuple(windows)


def window(rays_m: Floats) -> ScanWindow:
    """Where a scanner with (N, 3) echoes looked: not where a wide sector has no echo at all, be it low or
    high, nor lower than its lowest echo. One that saw less than half the circle was aimed, and looked no
    higher than its highest echo, nor did one whose head turns no further; any other saw the sky."""
    east, north, up = rays_m.T
    azimuth = np.floor(np.degrees(np.arctan2(north, east)) % 360.0).astype(np.int64) % 360
    seen = np.unique(azimuth)
    gaps = np.diff(seen, append=seen[0] + 360) - 1
    wide = gaps > WIDEST_GAP_DEG
    blind = tuple(
        (float(a + 1) % 360, float(a + 1 + gap) % 360) for a, gap in zip(seen[wide], gaps[wide], strict=True)
    )
    elevation = np.degrees(np.arctan2(up, np.hypot(east, north)))
    aimed = gaps[wide].sum() > 180
    highest = float(elevation.max()) if aimed else _stop(rays_m, azimuth, elevation)
    return ScanWindow(blind_deg=blind, lowest_deg=float(elevation.min()), highest_deg=highest)


def _stop(rays_m: Floats, azimuth: npt.NDArray[np.int64], elevation: Floats) -> float:
    """Where the scanner's head turns no further up: there its highest echoes end alike, whatever they are of;
    90 where they do not."""
    by_azimuth = np.lexsort((elevation, azimuth))
    last = np.flatnonzero(np.diff(azimuth[by_azimuth], append=360))
    top = by_azimuth[last]  # the highest echo of each degree
    stop = float(np.quantile(elevation[top], 1.0 - STRAY))
    there = top[np.abs(elevation[top] - stop) < ALIKE_DEG]
    near, far = np.quantile(np.linalg.norm(rays_m[there], axis=1), (0.1, 0.9))
    alike = len(there) >= MANY or (len(there) >= SOME and far > UNEVEN * near)
    return stop if alike and STOPS_DEG[0] < stop < STOPS_DEG[1] else 90.0


def hidden_share(rays_m: Floats) -> float:
    """Share of (N, 3) rays from one place that end behind the nearest end of their direction."""
    reach = np.linalg.norm(rays_m, axis=1)
    azimuth = np.degrees(np.arctan2(rays_m[:, 1], rays_m[:, 0])) % 360.0
    up = np.degrees(np.arcsin(np.clip(rays_m[:, 2] / np.maximum(reach, 1e-9), -1, 1))) + 90.0
    columns = int(360 / BIN_DEG)
    bins = (up / BIN_DEG).astype(np.int64) * columns + (azimuth / BIN_DEG).astype(np.int64) % columns
    nearest = np.full((int(180 / BIN_DEG) + 1) * columns, np.inf)
    np.minimum.at(nearest, bins, reach)
    return float(np.mean(reach > np.maximum(DEEPER * nearest[bins], nearest[bins] + LEAST_M)))
