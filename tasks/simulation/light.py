"""How much light falls on each point of a face: sun, sky, and what the rest of the scene throws back."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from tasks.simulation.face import Array, Face, FaceArrays
from tasks.simulation.raycast import cast

Floats = npt.NDArray[np.float32]

SUN_RADIUS_DEG = 0.27
BOUNCE = 0.3  # of the sky's light comes back from what hides the sky
SUN_RAYS = 12
SKY_RAYS = 96


@dataclass(frozen=True)
class Daylight:
    """Irradiances in units of an exposure; sun_from: unit vector towards the sun."""

    sun: float
    sky: float
    sun_from: tuple[float, float, float]

    @classmethod
    def of(cls, azimuth_deg: float, elevation_deg: float, sun: float, sky: float) -> "Daylight":
        a, e = np.radians([azimuth_deg, elevation_deg])
        return cls(sun, sky, (float(np.sin(a) * np.cos(e)), float(np.cos(a) * np.cos(e)), float(np.sin(e))))


@dataclass(frozen=True)
class LightMap:
    """(rows, columns) float32 of irradiance; texel (r, c) lies at v = r·texel_m, u = c·texel_m."""

    irradiance: Floats
    texel_m: float


def light_map(face: Face, faces: FaceArrays, daylight: Daylight, texel_m: float) -> LightMap:
    """Irradiance of `face` amid all faces, by casting rays to the sun's disc and over the hemisphere."""
    sky = _resized(_sky(face, faces, 6 * texel_m), face, 6 * texel_m, texel_m)
    total = daylight.sky * sky
    facing = float(face.normal @ np.asarray(daylight.sun_from))
    if facing > 0:
        total = total + daylight.sun * facing * _sunlit(face, faces, daylight, texel_m)
    return LightMap(np.ascontiguousarray(total, dtype=np.float32), texel_m)


def _grid(face: Face, texel_m: float) -> tuple[Array, tuple[int, int]]:
    rows, columns = int(face.height_m / texel_m) + 2, int(face.width_m / texel_m) + 2
    v, u = np.meshgrid(np.arange(rows) * texel_m, np.arange(columns) * texel_m, indexing="ij")
    uv = np.column_stack([np.minimum(u.ravel(), face.width_m), np.minimum(v.ravel(), face.height_m)])
    return face.to_world(uv) + 1e-4 * face.normal, (rows, columns)


def _sunlit(face: Face, faces: FaceArrays, daylight: Daylight, texel_m: float) -> Array:
    points, shape = _grid(face, texel_m)
    to_sun = np.asarray(daylight.sun_from)
    side = np.cross(to_sun, [0.0, 0.0, 1.0])
    side /= np.linalg.norm(side)
    over = np.cross(side, to_sun)
    lit = np.zeros(len(points))
    for k in range(SUN_RAYS):  # a spiral over the disc
        radius = np.radians(SUN_RADIUS_DEG) * np.sqrt((k + 0.5) / SUN_RAYS)
        angle = k * 2.399963
        ray = to_sun + radius * (np.cos(angle) * side + np.sin(angle) * over)
        hit, _ = cast(points, np.broadcast_to(ray, points.shape), faces)
        lit += hit < 0
    return (lit / SUN_RAYS).reshape(shape)


def _sky(face: Face, faces: FaceArrays, texel_m: float) -> Array:
    points, shape = _grid(face, texel_m)
    seen = np.zeros(len(points))
    for k in range(SKY_RAYS):  # cosine-weighted spiral over the hemisphere
        radius, angle = np.sqrt((k + 0.5) / SKY_RAYS), k * 2.399963
        local = np.array([radius * np.cos(angle), radius * np.sin(angle), np.sqrt(1 - radius**2)])
        ray = face.R_world_face @ local
        hit, _ = cast(points, np.broadcast_to(ray, points.shape), faces)
        below = 0.2 if ray[2] < 0 else 1.0  # no sky below the horizon, where nothing is modelled
        seen += np.where(hit < 0, below, BOUNCE)
    return (seen / SKY_RAYS).reshape(shape)


def _resized(coarse: Array, face: Face, coarse_m: float, fine_m: float) -> Array:
    rows, columns = int(face.height_m / fine_m) + 2, int(face.width_m / fine_m) + 2
    r = np.minimum(np.arange(rows) * fine_m / coarse_m, coarse.shape[0] - 1.001)
    c = np.minimum(np.arange(columns) * fine_m / coarse_m, coarse.shape[1] - 1.001)
    r0, c0 = r.astype(int), c.astype(int)
    fr, fc = (r - r0)[:, None], (c - c0)[None, :]
    top = coarse[r0][:, c0] * (1 - fc) + coarse[r0][:, c0 + 1] * fc
    low = coarse[r0 + 1][:, c0] * (1 - fc) + coarse[r0 + 1][:, c0 + 1] * fc
    return np.asarray(top * (1 - fr) + low * fr)
