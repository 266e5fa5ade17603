"""Which stated scanner positions can be believed: a scanner sees no two surfaces in one direction."""

import numpy as np
import numpy.typing as npt

from tasks.surfaces.cloud import Cloud, unit

Floats = npt.NDArray[np.float64]

BIN_DEG = 0.5
DEEPER = 1.15  # farther than the nearest point of its direction by this factor, and by LEAST_M, is behind it:
LEAST_M = 0.3  # flat ground seen at a grazing angle is not
OF_ONE_VIEW = 1e-12  # views are computed alike; normals, which stand for views not known, are never so near
MOST_HIDDEN = 0.05  # of a station's own points: edges and leaves make up to 2 %, false places 9 % and more


def scanners(cloud: Cloud, scanners_m: Floats) -> Floats:
    """(K, 3) of the scanners (S, 3), NaN where not known, those from which their points can have been seen.

    The origin of a cloud that was merged elsewhere, or that moved while it scanned, is no scanner's place.
    What was free can only be told from a true one."""
    believed = []
    for station in scanners_m[~np.isnan(scanners_m).any(axis=1)]:
        towards = unit(station - cloud.points)
        own = np.einsum("ni,ni->n", towards, cloud.views) > 1 - OF_ONE_VIEW
        if own.any() and hidden_share(cloud.points[own] - station) <= MOST_HIDDEN:
            believed.append(station)
    return np.array(believed).reshape(-1, 3)


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
