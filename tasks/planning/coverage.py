"""What the planned photos will see of a surface: rays from the planned poses, and from where the vehicle may
be instead when its position errs."""

from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import numpy.typing as npt
import shapely
from numba import njit

from schemas.camera import Camera, CameraPose
from schemas.surface import Surface
from schemas.vehicle import Vehicle
from tasks.planning.sight import Scene, outline_of
from tasks.planning.view_table import AROUND, view_table

Array = npt.NDArray[np.float64]
Flags = npt.NDArray[np.bool_]
Indices = npt.NDArray[np.int64]

MOST_SAMPLES = 200_000  # of one surface
FEWEST_SAMPLES = 100  # of one surface, however much smaller than a photo it is
SAMPLES_ACROSS = 12  # a photo's shorter side
GSD_TOLERANCE = 1.02  # a pixel this much larger than asked still counts: rounding of angles and places
BIAS_S = 120.0  # memory of the slow part of the position error, which walks over minutes
DRAWS = 200
THREADS = 2
TENTHS_OF_PERCENT = 1000.0


@dataclass(frozen=True)
class Samples:
    """A surface as equal squares."""

    uv_m: Array  # (N, 2) their middles
    points_m: Array  # (N, 3) in the world
    cell_m: float


@dataclass(frozen=True)
class Seen:
    """Of every sample of a surface: in how many photos it is seen well, and what else was in the way."""

    uv_m: Array  # (N, 2) middles of equal squares
    cell_m: float
    photos: npt.NDArray[np.int64]  # (N,) photos that see it at the asked GSD and angle
    hidden: Flags  # (N,) in a photo's frame but behind something
    oblique: Flags  # (N,) seen, but at more than the largest incidence
    coarse: Flags  # (N,) seen, but with larger pixels
    best_mm_px: Array  # (N,) smallest pixel that sees it within the angle, inf where none does
    shown: tuple[Indices, ...]  # of each photo the samples that it shows at the asked GSD and angle

    @property
    def covered(self) -> float:
        return float((self.photos > 0).mean()) if len(self.photos) else 0.0


@dataclass(frozen=True)
class Drawn:
    """What is seen when positions err: of each draw a share of the samples, of each sample its pixel."""

    once: Array  # (D,) share of the samples in at least one photo at the asked GSD and angle
    twice: Array  # (D,) in at least two
    lacking: Array  # (N,) of the worst tenth of the draws, the share in which a sample is not in two
    mm_px: Array  # (N,) pixel size that 95 % of the draws reach, inf where fewer see the sample at all


def samples_of(surface: Surface, camera: Camera, gsd_mm_px: float) -> Samples:
    shorter_m = min(camera.width_px, camera.height_px) * gsd_mm_px / 1000
    uv, cell = _samples(surface, shorter_m / SAMPLES_ACROSS)
    return Samples(uv, surface.to_world(uv), cell)


def seen_by(
    surface: Surface,
    camera: Camera,
    poses: Sequence[CameraPose],
    gsd_mm_px: float,
    max_incidence_deg: float,
    scene: Scene,
    samples: Samples | None = None,
) -> Seen:
    """Sample the surface's area evenly and count for each sample the photos that see it."""
    samples = samples or samples_of(surface, camera, gsd_mm_px)
    table = view_table(surface, camera, poses, samples.points_m, scene, 0.0)
    count = len(samples.uv_m)
    photos = np.zeros(count, dtype=np.int64)
    hidden, oblique, coarse = (np.zeros(count, dtype=bool) for _ in range(3))
    well, best = np.zeros(len(table.samples), dtype=bool), np.full(count, np.inf)
    _count(
        table.eyes_m, table.R_world_camera, table.first, table.samples, table.visible[0],
        samples.points_m, np.asarray(surface.plane.normal), *_optics(camera),
        gsd_mm_px * GSD_TOLERANCE, np.cos(np.radians(max_incidence_deg)) - 1e-9,
        photos, well, hidden, oblique, coarse, best,
    )  # fmt: skip
    shown = tuple(table.samples[a:b][well[a:b]] for a, b in pairwise(table.first))
    return Seen(samples.uv_m, samples.cell_m, photos, hidden, oblique, coarse, best, shown)


def seen_off_course(
    surface: Surface,
    camera: Camera,
    poses: Sequence[CameraPose],
    vehicle: Vehicle,
    gsd_mm_px: float,
    max_incidence_deg: float,
    scene: Scene,
    samples: Samples,
) -> tuple[Indices, ...]:
    """Of each photo what it shows, as `seen_by` judges it, from each of the places `AROUND` the planned one,
    off by the position error's bound: numbers of samples, plus their count times the place's number.

    A place off along the surface, or not at all, may be farther back too, up to the error's bound in 3D:
    pixels are judged there. The other places are nearer to the surface, or that far back already."""
    sigma = float(np.hypot(vehicle.position_bias_m, vehicle.position_jitter_m))
    table = view_table(surface, camera, poses, samples.points_m, scene, sigma)
    reach = off_course_m(surface, vehicle)
    back = np.sqrt(np.maximum(vehicle.position_error_m**2 - (reach**2).sum(axis=1), 0.0))
    back[AROUND[:, 2] != 0] = 0.0
    well = np.zeros(table.visible.shape, dtype=bool)
    for place, offset in enumerate(reach):
        _shows(
            table.eyes_m + offset, table.R_world_camera, table.first, table.samples, table.visible[place],
            samples.points_m, np.asarray(surface.plane.normal), *_optics(camera),
            gsd_mm_px * GSD_TOLERANCE, np.cos(np.radians(max_incidence_deg)) - 1e-9, back[place], well[place],
        )  # fmt: skip
    numbers = table.samples + len(samples.uv_m) * np.arange(len(reach))[:, None]
    return tuple(numbers[:, a:b][well[:, a:b]] for a, b in pairwise(table.first))


def off_course_m(surface: Surface, vehicle: Vehicle) -> Array:
    """(7, 3) world: where a flight is off that errs along none or one of the surface's axes, by the bound."""
    return np.asarray(AROUND @ surface.R_world_surface.T * vehicle.sideways_error_m)


def drawn(
    surface: Surface,
    camera: Camera,
    poses: Sequence[CameraPose],
    times_s: Array,
    vehicle: Vehicle,
    gsd_mm_px: float,
    max_incidence_deg: float,
    scene: Scene,
    reachable: Flags,
    samples: Samples | None = None,
    draws: int = DRAWS,
    seed: int = 0,
) -> Drawn:
    """Fly the photos `draws` times, each with another walk of the position error.

    times_s: (P,) when each photo is taken; a battery change is time enough to forget the bias.
    reachable: (N,) of the surface's samples, those that the shares count."""
    samples = samples or samples_of(surface, camera, gsd_mm_px)
    sigma = float(np.hypot(vehicle.position_bias_m, vehicle.position_jitter_m))
    table = view_table(surface, camera, poses, samples.points_m, scene, sigma)
    rng = np.random.default_rng([seed, 0x64726177])
    once, twice = np.zeros(draws), np.zeros(draws)
    lacks = np.zeros((draws, len(samples.uv_m)), dtype=bool)
    optics = _optics(camera)
    tenths = np.full((draws, len(samples.uv_m)), np.iinfo(np.uint16).max, dtype=np.uint16)

    def fly(draw: int, offsets: Array) -> None:
        nearest = ((offsets[:, None] - table.around_m) ** 2).sum(axis=2).argmin(axis=1)
        photos, best = _photos_of(
            table.eyes_m + offsets, nearest, table.R_world_camera, table.first, table.samples, table.visible,
            samples.points_m, np.asarray(surface.plane.normal), *optics,
            gsd_mm_px * GSD_TOLERANCE, np.cos(np.radians(max_incidence_deg)) - 1e-9,
        )  # fmt: skip
        if reachable.any():
            once[draw], twice[draw] = (photos[reachable] >= 1).mean(), (photos[reachable] >= 2).mean()
        lacks[draw] = photos < 2
        tenths[draw] = np.minimum(best / gsd_mm_px * TENTHS_OF_PERCENT, np.iinfo(np.uint16).max)

    errors = [position_errors(times_s, vehicle, rng) for _ in range(draws)]
    with ThreadPoolExecutor(THREADS) as threads:  # the kernels leave Python's lock
        list(threads.map(fly, range(draws), errors))
    most = np.partition(tenths, int(np.ceil(0.95 * draws)) - 1, axis=0)[int(np.ceil(0.95 * draws)) - 1]
    mm_px = np.where(most < np.iinfo(np.uint16).max, most * gsd_mm_px / TENTHS_OF_PERCENT, np.inf)
    worst = np.argsort(twice, kind="stable")[: max(1, draws // 10)]
    return Drawn(once, twice, lacks[worst].mean(axis=0), mm_px)


def position_errors(times_s: Array, vehicle: Vehicle, rng: np.random.Generator) -> Array:
    """(P, 3) metres: a bias that walks (Ornstein-Uhlenbeck, exact between photos) and jitter."""
    steps = np.exp(-np.abs(np.diff(times_s)) / BIAS_S)
    noise = rng.standard_normal((len(times_s), 3))
    bias = _walk(steps, noise)
    jitter = rng.standard_normal((len(times_s), 3))
    return np.asarray(vehicle.position_bias_m * bias + vehicle.position_jitter_m * jitter)


def reasons(seen: Seen, unreachable: Mapping[str, float], reachable: Flags) -> tuple[str, ...]:
    """Why parts of the surface are not surely seen, in words with their areas; empty where all of it is.

    unreachable: m² by the reason why no place shows them surely; what else is missed is a photo's fault."""
    told = [f"{area:.2f} m² {reason}" for reason, area in unreachable.items()]
    missed = float(((seen.photos == 0) & reachable).sum()) * seen.cell_m**2
    if missed > seen.cell_m**2 / 2:
        told.append(f"{missed:.2f} m² in no photo at the asked size of pixels and angle")
    return tuple(told)


def _samples(surface: Surface, spacing_m: float) -> tuple[Array, float]:
    """(N, 2) middles of the squares of a grid that lie inside the outline, and the squares' side."""
    outline = outline_of(surface)
    cell = max(spacing_m, float(np.sqrt(outline.area / MOST_SAMPLES)))
    u_low, v_low, u_high, v_high = surface.bounds_m
    while True:
        us, vs = np.arange(u_low + cell / 2, u_high, cell), np.arange(v_low + cell / 2, v_high, cell)
        u, v = np.meshgrid(us, vs)
        inside = shapely.contains_xy(outline, u, v)
        if inside.sum() >= FEWEST_SAMPLES or outline.area == 0:
            return np.column_stack([u[inside], v[inside]]), cell
        cell /= 2  # a strip may lie between the middles of coarser squares


def _optics(camera: Camera) -> tuple[tuple[float, ...], float]:
    """What the kernels need of a camera, and the squared ideal radius beyond which its distortion folds
    points back into the frame."""
    cx, cy = camera.principal_px
    right, bottom = camera.width_px - 0.5, camera.height_px - 0.5
    corners = np.array([(-0.5, -0.5), (right, -0.5), (-0.5, bottom), (right, bottom)])
    ideal = camera.undistort((corners - camera.principal_px) / camera.focal_px)
    size = float(camera.width_px), float(camera.height_px)
    lens = (camera.k1, camera.k2, camera.p1, camera.p2, camera.k3, camera.k4, float(camera.lens == "fisheye"))
    return (camera.focal_px, cx, cy, *size, *lens), float((ideal**2).sum(axis=1).max()) * (1 + 1e-6)


@njit(cache=True)
def _radial(r2, k1, k2, k3, k4, fisheye):  # type: ignore[no-untyped-def]
    """Distorted over ideal distance from the principal point, and for a fisheye its slope by that distance,
    over the distance (schemas/distortion.py)."""
    if not fisheye:
        return 1 + r2 * (k1 + r2 * (k2 + r2 * k3)), 0.0
    if r2 < 1e-8:
        return 1.0, 2 * (k1 - 1 / 3)
    t = np.arctan(np.sqrt(r2))
    t2 = t * t
    radial = t / np.sqrt(r2) * (1 + t2 * (k1 + t2 * (k2 + t2 * (k3 + t2 * k4))))
    by_t = 1 + t2 * (3 * k1 + t2 * (5 * k2 + t2 * (7 * k3 + t2 * 9 * k4)))
    return radial, (by_t / (1 + r2) - radial) / r2


@njit(cache=True)
def _bends(optics):  # type: ignore[no-untyped-def]
    """Whether the lens distorts at all."""
    _, _, _, _, _, k1, k2, p1, p2, k3, k4, fisheye = optics
    return k1 != 0 or k2 != 0 or p1 != 0 or p2 != 0 or k3 != 0 or k4 != 0 or fisheye != 0


@njit(cache=True)
def _walk(kept, noise):  # type: ignore[no-untyped-def]
    walk = noise.copy()
    for p in range(1, len(noise)):
        walk[p] = kept[p - 1] * walk[p - 1] + np.sqrt(1 - kept[p - 1] ** 2) * noise[p]
    return walk


@njit(cache=True, inline="always")
def _photo(eyes, turns, normal, p):  # type: ignore[no-untyped-def]
    """What `_view` needs of one photo, as plain numbers: eye, axes, and the normal in the camera's frame."""
    R = turns[p]
    facing = (
        R[0, 0] * normal[0] + R[1, 0] * normal[1] + R[2, 0] * normal[2],
        R[0, 1] * normal[0] + R[1, 1] * normal[1] + R[2, 1] * normal[2],
        R[0, 2] * normal[0] + R[1, 2] * normal[1] + R[2, 2] * normal[2],
    )
    axes = (R[0, 0], R[1, 0], R[2, 0], R[0, 1], R[1, 1], R[2, 1], R[0, 2], R[1, 2], R[2, 2])
    return (eyes[p, 0], eyes[p, 1], eyes[p, 2]), axes, facing


@njit(cache=True)
def _view(px, py, pz, photo, optics, widest, bent):  # type: ignore[no-untyped-def]
    """Whether a photo's frame holds a point; the squared cosine of its incidence (0 from behind), and the
    squared ground sample distance (mm/px) along its worst direction. bent: whether the lens distorts.

    A point seen at ideal (x, y) lies at z·(x, y, 1) with z = c / (n·(x, y, 1)); the derivatives with respect
    to x and y, over the focal length, are a pixel's sides on the surface."""
    eye, axes, facing = photo
    dx, dy, dz = px - eye[0], py - eye[1], pz - eye[2]
    z = axes[6] * dx + axes[7] * dy + axes[8] * dz
    if z <= 1e-9:
        return False, 0.0, np.inf
    over_z = 1.0 / z
    x = (axes[0] * dx + axes[1] * dy + axes[2] * dz) * over_z
    y = (axes[3] * dx + axes[4] * dy + axes[5] * dz) * over_z
    r2 = x * x + y * y
    if r2 > widest:
        return False, 0.0, np.inf
    f, cx, cy, width, height, k1, k2, p1, p2, k3, k4, fisheye = optics
    radial, bend, column, row = 1.0, 0.0, f * x + cx + 0.5, f * y + cy + 0.5
    if bent:
        radial, bend = _radial(r2, k1, k2, k3, k4, fisheye)
        column = f * (x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x)) + cx + 0.5
        row = f * (y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y) + cy + 0.5
    if not (0 <= column <= width and 0 <= row <= height):
        return False, 0.0, np.inf
    nx, ny, nz = facing
    towards = x * nx + y * ny + nz
    if towards >= -1e-9:
        return True, 0.0, np.inf
    slope = -z / towards
    ax, ay, az = z + slope * nx * x, slope * nx * y, slope * nx
    bx, by, bz = slope * ny * x, z + slope * ny * y, slope * ny
    if fisheye:  # its pixels' rays are not those of an ideal lens: (radial·I + bend·x xᵀ)⁻¹ to the right
        share = bend / (radial + bend * r2)
        tx, ty, tz = share * (ax * x + bx * y), share * (ay * x + by * y), share * (az * x + bz * y)
        ax, ay, az = (ax - tx * x) / radial, (ay - ty * x) / radial, (az - tz * x) / radial
        bx, by, bz = (bx - tx * y) / radial, (by - ty * y) / radial, (bz - tz * y) / radial
    aa, bb, ab = ax * ax + ay * ay + az * az, bx * bx + by * by + bz * bz, ax * bx + ay * by + az * bz
    largest = (aa + bb) / 2 + np.sqrt(((aa - bb) / 2) ** 2 + ab * ab)
    return True, towards * towards / (r2 + 1), largest * (1e6 / (f * f))


@njit(cache=True)
def _count(  # type: ignore[no-untyped-def]
    eyes, turns, first, samples, visible, points, normal, optics, widest, gsd, least_cos,
    photos, well, hidden, oblique, coarse, best,
):  # fmt: skip
    bent = _bends(optics)
    for p in range(len(eyes)):
        photo = _photo(eyes, turns, normal, p)
        for k in range(first[p], first[p + 1]):
            s = samples[k]
            inside, cos2, size2 = _view(points[s, 0], points[s, 1], points[s, 2], photo, optics, widest, bent)
            if not inside:
                continue
            if not visible[k]:
                hidden[s] = True
            elif cos2 < least_cos * least_cos:
                oblique[s] = True
            else:
                best[s] = min(best[s], np.sqrt(size2))
                if size2 > gsd * gsd:
                    coarse[s] = True
                else:
                    photos[s] += 1
                    well[k] = True


@njit(cache=True)
def _shows(  # type: ignore[no-untyped-def]
    eyes, turns, first, samples, visible, points, normal, optics, widest, gsd, least_cos, back_m, well
):
    bent = _bends(optics)
    for p in range(len(eyes)):
        photo = _photo(eyes, turns, normal, p)
        eye = photo[0]
        for k in range(first[p], first[p + 1]):
            if visible[k]:
                x, y, z = points[samples[k], 0], points[samples[k], 1], points[samples[k], 2]
                inside, cos2, size2 = _view(x, y, z, photo, optics, widest, bent)
                if inside and cos2 >= least_cos * least_cos:
                    away = np.sqrt((x - eye[0]) ** 2 + (y - eye[1]) ** 2 + (z - eye[2]) ** 2)
                    well[k] = np.sqrt(size2) * (1 + back_m / away) <= gsd


@njit(cache=True, nogil=True)
def _photos_of(  # type: ignore[no-untyped-def]
    eyes, places, turns, first, samples, visible, points, normal, optics, widest, gsd, least_cos
):
    photos = np.zeros(len(points), dtype=np.int64)
    best2 = np.full(len(points), np.inf)
    least_cos2, gsd2, bent = least_cos * least_cos, gsd * gsd, _bends(optics)
    for p in range(len(eyes)):
        photo = _photo(eyes, turns, normal, p)
        seen = visible[places[p]]
        for k in range(first[p], first[p + 1]):
            if seen[k]:
                s = samples[k]
                inside, cos2, size2 = _view(
                    points[s, 0], points[s, 1], points[s, 2], photo, optics, widest, bent
                )
                if inside and cos2 >= least_cos2:
                    best2[s] = min(best2[s], size2)
                    photos[s] += size2 <= gsd2
    return photos, np.sqrt(best2)
