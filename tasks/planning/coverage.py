"""What the planned photos will see of a surface, by casting rays from the planned poses."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import shapely

from schemas.camera import Camera, CameraPose
from schemas.surface import Surface
from tasks.planning.sight import Scene, outline_of

Array = npt.NDArray[np.float64]
Flags = npt.NDArray[np.bool_]

MOST_SAMPLES = 200_000  # of one surface
GSD_TOLERANCE = 1.1  # a pixel this much larger than asked still counts


@dataclass(frozen=True)
class Seen:
    """Of every sample of a surface: in how many photos it is seen well, and what else was in the way."""

    uv_m: Array  # (N, 2) middles of equal squares
    cell_m: float
    photos: npt.NDArray[np.int64]  # (N,) photos that see it at the asked GSD and angle
    hidden: Flags  # (N,) in a photo's frame but behind something
    oblique: Flags  # (N,) seen, but at more than the largest incidence
    coarse: Flags  # (N,) seen, but with larger pixels

    @property
    def covered(self) -> float:
        return float((self.photos > 0).mean()) if len(self.photos) else 0.0


def seen_by(
    surface: Surface,
    camera: Camera,
    poses: Sequence[CameraPose],
    gsd_mm_px: float,
    max_incidence_deg: float,
    scene: Scene,
) -> Seen:
    """Sample the surface's area evenly and count for each sample the photos that see it."""
    uv, cell = _samples(surface, min(camera.footprint_m(camera.stand_off_m(gsd_mm_px))) / 12)
    points = surface.to_world(uv)
    photos = np.zeros(len(uv), dtype=np.int64)
    hidden, oblique, coarse = (np.zeros(len(uv), dtype=bool) for _ in range(3))
    for pose in poses:
        index = _in_frame(camera, pose, points)
        if not index.size:
            continue
        visible = scene.sees(np.asarray(pose.position_m), points[index])
        cos_incidence, gsd = _view_of(surface, camera, pose, points[index])
        steep = cos_incidence >= np.cos(np.radians(max_incidence_deg)) - 1e-9
        fine = gsd <= gsd_mm_px * GSD_TOLERANCE
        photos[index[visible & steep & fine]] += 1
        hidden[index[~visible]] = True
        oblique[index[visible & ~steep]] = True
        coarse[index[visible & steep & ~fine]] = True
    return Seen(uv, cell, photos, hidden, oblique, coarse)


def reasons(seen: Seen, refused: Counter[str]) -> tuple[str, ...]:
    """Why parts of the surface are not seen, in words with their areas; empty where all of it is."""
    missed = seen.photos == 0
    behind = missed & seen.hidden
    angled = missed & ~behind & seen.oblique
    small = missed & ~behind & ~angled & seen.coarse
    never = missed & ~behind & ~angled & ~small
    words = [
        (behind, "hidden behind something"),
        (angled, "seen only at too large an angle"),
        (small, "seen only with pixels larger than asked"),
        (never, "in no photo"),
    ]
    areas = [(float(flags.sum()) * seen.cell_m**2, text) for flags, text in words]
    told = [f"{area:.2f} m² {text}" for area, text in areas if area > 0]
    if told:
        told += [f"{count} shooting points left out: {reason}" for reason, count in sorted(refused.items())]
    return tuple(told)


def _samples(surface: Surface, spacing_m: float) -> tuple[Array, float]:
    """(N, 2) middles of the squares of a grid that lie inside the outline, and the squares' side."""
    outline = outline_of(surface)
    cell = max(spacing_m, float(np.sqrt(outline.area / MOST_SAMPLES)))
    u_low, v_low, u_high, v_high = surface.bounds_m
    u, v = np.meshgrid(np.arange(u_low + cell / 2, u_high, cell), np.arange(v_low + cell / 2, v_high, cell))
    inside = shapely.contains_xy(outline, u, v)
    return np.column_stack([u[inside], v[inside]]), cell


def _in_frame(camera: Camera, pose: CameraPose, points_m: Array) -> npt.NDArray[np.int64]:
    """Indices of the (N, 3) points that a photo shows. Points far off the axis are taken out first, since
    the distortion's polynomial can fold them back into the frame."""
    corners = [(-0.5, -0.5), (camera.width_px - 0.5, -0.5), (-0.5, camera.height_px - 0.5)]
    corners.append((camera.width_px - 0.5, camera.height_px - 0.5))
    forward = pose.R_world_camera[:, 2]
    widest = float((camera.back_project(corners, pose) @ forward).min())
    ray = points_m - np.asarray(pose.position_m)
    near_axis = np.flatnonzero(ray @ forward >= (widest - 1e-6) * np.linalg.norm(ray, axis=1))
    pixels = camera.project(points_m[near_axis], pose) + 0.5
    inside = np.all((pixels >= 0) & (pixels <= (camera.width_px, camera.height_px)), axis=1)
    return near_axis[inside]


def _view_of(surface: Surface, camera: Camera, pose: CameraPose, points_m: Array) -> tuple[Array, Array]:
    """Cosine of the incidence and ground sample distance (mm/px, along its worst direction) of (N, 3) points.

    A point seen at normalised (x, y) lies at z·(x, y, 1) with z = c / (n·(x, y, 1)); the derivatives with
    respect to x and y, over the focal length, are a pixel's sides on the surface.
    """
    ray = (points_m - np.asarray(pose.position_m)) @ pose.R_world_camera  # in camera coordinates
    normal = np.asarray(surface.plane.normal) @ pose.R_world_camera
    z = ray[:, 2:]
    direction = ray / z
    towards = direction @ normal
    slope = -(z[:, 0] / towards)[:, None]
    side_x = z * [1.0, 0.0, 0.0] + slope * normal[0] * direction
    side_y = z * [0.0, 1.0, 0.0] + slope * normal[1] * direction
    xx, yy, xy = ((a * b).sum(axis=1) for a, b in ((side_x, side_x), (side_y, side_y), (side_x, side_y)))
    largest = (xx + yy) / 2 + np.sqrt(((xx - yy) / 2) ** 2 + xy**2)
    cos_incidence = -towards / np.linalg.norm(direction, axis=1)
    return cos_incidence, np.sqrt(largest) * 1000.0 / camera.focal_px
