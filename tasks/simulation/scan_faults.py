"""What goes wrong in a scan, each by itself: systematic errors, mixed pixels, dropouts, lost station marks.

Every magnitude is in schemas.scanning.Scanning; at zero nothing changes.
"""

import numpy as np
import numpy.typing as npt
from scipy.ndimage import maximum_filter, minimum_filter

from schemas.scanning import Scanning
from tasks.simulation.face import Array, Face
from tasks.simulation.scan_target import MIXED, NOTHING, Hits, ScanTarget

WAVELENGTH_M = 1.2  # of the cyclic error: half the longest modulation wave of a phase meter
RAYS_A_BEAM = 9
PULSE_M = 0.6  # echoes closer than half a pulse's length reach the receiver as one
STEP_M = 0.02  # ranges of neighbours that differ by more may be of two things
REFLECTANCE = {"metal": 0.4, "leaf": 0.7, "ground": 0.6}  # of concrete's
GLASS_RETURNS = 0.1  # share of pulses; the others go on into a dark room
FAR_M = 1e4


def every_fault(seed: int) -> Scanning:
    """All faults at once, their magnitudes drawn from what terrestrial scanners and sites show."""
    rng = np.random.default_rng([seed, 0x466C74])

    def between(low: float, high: float) -> float:
        return float(rng.uniform(low, high))

    return Scanning(
        astray=int(rng.integers(1, 3)),
        astray_m=float(10 ** rng.uniform(-0.3, 1.0)),
        range_offset_m=between(-0.0015, 0.0015),
        range_scale_ppm=between(-30, 30),
        range_wave_m=between(0, 0.001),
        collimation_deg=between(-0.004, 0.004),
        trunnion_deg=between(-0.004, 0.004),
        index_deg=between(-0.004, 0.004),
        beam_mrad=between(0.25, 0.5),
        reach_m=between(40, 70),
        people=int(rng.integers(3, 9)),
        cars=int(rng.integers(1, 4)),
        sway_m=between(0.03, 0.12),
    )


def range_error_m(distance_m: Array, scanning: Scanning) -> Array:
    """(N,) systematic: an offset, a scale and a phase meter's wave."""
    wave = np.sin(2 * np.pi * distance_m / WAVELENGTH_M)
    return np.asarray(
        scanning.range_offset_m + 1e-6 * scanning.range_scale_ppm * distance_m + scanning.range_wave_m * wave
    )


def misread(azimuth: Array, elevation: Array, scanning: Scanning) -> tuple[Array, Array]:
    """The angles (radians) that the circles show for rays in these directions.

    A theodolite's errors: collimation c/cos(e), trunnion i·tan(e), index. A panoramic scanner sees one half
    of the circle in face left and the other in face right, where they have the other sign.
    """
    face = np.where(azimuth < np.pi, 1.0, -1.0)
    collimation, trunnion, index = np.radians(
        [scanning.collimation_deg, scanning.trunnion_deg, scanning.index_deg]
    )
    turned = collimation / np.cos(elevation) + trunnion * np.tan(elevation)
    return azimuth + face * turned, elevation + face * index


def mixed(
    target: ScanTarget,
    origin_m: npt.ArrayLike,
    directions: Array,
    hits: Hits,
    shape: tuple[int, int],
    beam_mrad: float,
) -> Hits:
    """The hits of a beam of finite width: at an edge it meets two things, and the range lies between them
    unless they are so far apart that the first echo stands alone.

    directions, hits: of N rays, a grid of `shape` (elevation × azimuth).
    """
    seen_m = np.where(np.isfinite(hits.distance_m), hits.distance_m, FAR_M).reshape(shape)
    apart_m = maximum_filter(seen_m, 3, mode="wrap") - minimum_filter(seen_m, 3, mode="wrap")
    edge = np.flatnonzero(apart_m.ravel() > STEP_M)
    aim = directions[edge]
    p = np.cross(aim, np.where(np.abs(aim[:, 2:]) < 0.7, [[0.0, 0.0, 1.0]], [[1.0, 0.0, 0.0]]))
    p /= np.linalg.norm(p, axis=1, keepdims=True)
    q = np.cross(aim, p)
    k = np.arange(1, RAYS_A_BEAM)
    radius = 1e-3 * beam_mrad / 2 * np.sqrt(k / (RAYS_A_BEAM - 1))
    turn = k * np.pi * (3 - np.sqrt(5))  # a sunflower's: even over the disc
    around = aim[:, None] + radius[:, None] * (
        np.cos(turn)[:, None] * p[:, None] + np.sin(turn)[:, None] * q[:, None]
    )
    others = target.cast(origin_m, around.reshape(-1, 3))
    ranges_m = np.column_stack([hits.distance_m[edge], others.distance_m.reshape(len(edge), -1)])
    faces = np.column_stack([hits.face[edge], others.face.reshape(len(edge), -1)])
    first = ranges_m.argmin(axis=1)
    rows = np.arange(len(edge))
    echo = ranges_m <= ranges_m[rows, first][:, None] + PULSE_M
    echo &= np.isfinite(ranges_m)
    share = np.maximum(echo.sum(axis=1), 1)
    mean_m = np.where(echo, ranges_m, 0.0).sum(axis=1) / share
    spread_m = np.where(echo, np.abs(ranges_m - mean_m[:, None]), 0.0).max(axis=1)
    distance_m, face, slant = hits.distance_m.copy(), hits.face.copy(), hits.slant.copy()
    distance_m[edge] = np.where(echo.any(axis=1), mean_m, np.inf)
    one_face = np.where(echo, faces == faces[rows, first][:, None], True).all(axis=1)
    whose = np.where(one_face | (spread_m < STEP_M / 2), faces[rows, first], MIXED)
    face[edge] = np.where(echo.any(axis=1), whose, NOTHING)
    slant[edge] = np.where(np.isfinite(hits.distance_m[edge]), hits.slant[edge], 1.0)
    return Hits(distance_m, face, slant)


def returned(
    hits: Hits, faces: tuple[Face, ...], reach_m: float | None, rng: np.random.Generator
) -> npt.NDArray[np.bool_]:
    """(N,) whether a pulse comes back: fainter with distance, slant and dark materials."""
    glass = np.array([f.material == "glass" for f in faces])
    if reach_m is None and not glass.any():
        return np.ones(len(hits.face), dtype=bool)
    chance = np.ones(len(hits.face))
    of_scene = hits.face >= 0
    if reach_m is not None:
        bright = np.array([REFLECTANCE.get(f.material, 1.0) for f in faces])
        signal = np.maximum(hits.slant, 1e-3)
        signal[of_scene] *= bright[hits.face[of_scene]]
        met = np.isfinite(hits.distance_m)
        chance[met] = 0.5 ** ((hits.distance_m[met] / reach_m) ** 2 / signal[met])
    chance[of_scene] *= np.where(glass[hits.face[of_scene]], GLASS_RETURNS, 1.0)
    return np.asarray(rng.random(len(chance)) < chance)


def astray_m(scanning: Scanning, stations: int, seed: int) -> Array:
    """(S, 3) blunders of the stations' measured positions: in a random horizontal direction."""
    rng = np.random.default_rng([seed, 0x417374])
    off = np.zeros((stations, 3))
    lost = rng.permutation(stations)[: scanning.astray]
    turn = rng.uniform(0, 2 * np.pi, len(lost))
    off[lost, :2] = scanning.astray_m * np.column_stack([np.cos(turn), np.sin(turn)])
    return off
