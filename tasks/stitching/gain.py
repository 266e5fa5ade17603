"""Gain compensation: an exposure factor a photo and a lens's falloff a camera, all solved together (Brown &
Lowe 2007, section 6; Goldman 2010), then each photo's colour balance.

Photos are compared in linear light where they overlap, as placed by the adjustment. Without the falloff, the
darker rim of each photo would pass for a darker photo, and gains would drift across the mosaic. Sums of
absolute differences: shadows that moved and highlights that are clipped hardly count."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import cv2
import numba
import numpy as np
import numpy.typing as npt
from scipy.sparse import csr_matrix

from tasks.stitching.bundle import camera_key
from tasks.stitching.skyline import solve_positive
from tasks.stitching.view import Array, View

Pixels = npt.NDArray[np.uint8]
Floats = npt.NDArray[np.float32]

SHRINK = 8  # photos are averaged over squares of so many pixels before they are compared
SAMPLES = 36  # a side of the grid laid over each photo
SIGMA_GAIN = 1.0  # 1σ of a photo's log exposure; binds only what overlaps nothing
SIGMA_METERED = 0.05  # and of what it differs from what the camera says it set
SIGMA_PAIR = 0.02  # of the log ratio of two photos, all samples alike: surfaces shine, air scatters
SIGMA_FALLOFF = 0.5  # 1σ of the log of a lens's falloff in the corner, each of its two terms
SIGMA_BALANCE = 0.05  # 1σ of the log of red and blue against green
SOFT = 0.01  # log ratios that differ by more count by their absolute value
ROUNDS = 10
LEAST_SAMPLES = 20
TERMS = 2  # of the falloff: squared and fourth power of the distance from the middle
FALLOFF_STEPS = 4096  # from the axis to the rim: a step is 0.01 grey levels at most
RIM = 1.3  # farther out than this, in squared half diagonals, no photo reaches


@dataclass(frozen=True)
class Light:
    """What brings photos to one light: factors on linear light, geometric mean 1 for each colour."""

    gains: Array  # (N, 3) of red, green, blue
    falloff: Array  # (N, TERMS) log of the factor is falloff · (ρ², ρ⁴), ρ = 1 in the corner


def srgb_to_linear() -> npt.NDArray[np.float32]:
    """(256,) linear light 0..1 of sRGB levels."""
    s = np.arange(256) / 255.0
    return np.where(s <= 0.04045, s / 12.92, ((s + 0.055) / 1.055) ** 2.4).astype(np.float32)


def gain_table(gain: float) -> npt.NDArray[np.float32]:
    """(256,) sRGB levels (0..255, not rounded) after `gain` in linear light."""
    linear = np.clip(srgb_to_linear().astype(np.float64) * gain, 0.0, 1.0)
    srgb = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
    return (255.0 * srgb).astype(np.float32)


def relit(pixels: Pixels, at: Floats, view: View, table: Floats, falloff: Array) -> Floats:
    """(h, w, 3) sRGB levels of `pixels`, seen at photo pixels `at` (h, w, 2): by `table` (256, 3), as
    gain_table gives it for each colour, then without the lens's falloff.

    A factor on linear light is one on the sRGB level + 14.025, but for the darkest ten levels."""
    w, h = view.camera.width_px, view.camera.height_px
    rho2 = np.linspace(0.0, RIM, FALLOFF_STEPS + 1)
    factor = np.exp(rho2 * (falloff[0] + rho2 * falloff[1]) / 2.4).astype(np.float32)
    lens = np.array([*view.camera.principal_px, FALLOFF_STEPS / RIM * 4.0 / (w * w + h * h)], np.float32)
    return np.asarray(_relit(pixels, at, table, lens, factor), np.float32)


@numba.njit(cache=True, nogil=True)
def _relit(pixels: Pixels, at: Floats, table: Floats, lens: Floats, factor: Floats) -> Floats:
    """lens: the axis's pixel, and steps of `factor` per squared pixel from it."""
    levels = np.empty(pixels.shape, np.float32)
    lift, last = np.float32(14.025), np.float32(len(factor) - 1)
    for y in range(pixels.shape[0]):
        for x in range(pixels.shape[1]):
            dx, dy = at[y, x, 0] - lens[0], at[y, x, 1] - lens[1]
            step = min((dx * dx + dy * dy) * lens[2], last)
            brighter = factor[int(step + np.float32(0.5))]
            for c in range(3):
                levels[y, x, c] = (table[pixels[y, x, c], c] + lift) * brighter - lift
    return levels


def _rho2(at: npt.NDArray[np.floating], view: View) -> npt.NDArray[np.floating]:
    """Squared distance of photo pixels (…, 2) from the lens's axis, about 1 in the corners."""
    w, h = view.camera.width_px, view.camera.height_px
    off = at - np.array(view.camera.principal_px, at.dtype)
    return np.asarray(np.minimum((off**2).sum(axis=-1) * at.dtype.type(4.0 / (w * w + h * h)), RIM))


def solve_light(
    views: Sequence[View],
    read: Callable[[int], Pixels],
    pairs: Sequence[tuple[int, int]],
    metered_ev: Sequence[float | None],
    on_progress: Callable[[float], None],
) -> Light:
    """`read(i)` gives photo i as RGB; one at a time. metered_ev: exposures as the camera set them, which
    keep gains from drifting along the mosaic; None where it does not say."""
    count = len(views)
    small = []
    for i in range(count):
        small.append(_linear_small(read(i)))
        on_progress((i + 1) / count)
    found = [_overlap(i, j, views, small) for i, j in pairs]
    samples = [s for s in found if len(s.ratio) >= LEAST_SAMPLES]
    keys = [camera_key(view.camera) for view in views]
    cameras = list(dict.fromkeys(keys))
    camera_of = np.array([cameras.index(key) for key in keys])
    if not samples:
        return Light(np.ones((count, 3)), np.zeros((count, TERMS)))
    a = np.concatenate([np.full(len(s.ratio), s.a) for s in samples])
    b = np.concatenate([np.full(len(s.ratio), s.b) for s in samples])
    ratio = np.concatenate([s.ratio for s in samples])
    rho2_a, rho2_b = (np.concatenate([s.rho2[k] for s in samples]) for k in range(2))
    row, one = np.arange(len(a)), np.ones(len(a))
    rows, columns, values = [row, row], [a, b], [one, -one]
    for k in range(TERMS):
        rows += [row, row]
        columns += [count + TERMS * camera_of[a] + k, count + TERMS * camera_of[b] + k]
        values += [rho2_a ** (k + 1), -(rho2_b ** (k + 1))]
    size = count + TERMS * len(cameras)
    design = csr_matrix(
        (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))), shape=(len(a), size)
    )
    told = np.array([0.0 if ev is None else -ev * np.log(2.0) for ev in metered_ev])
    sigma = np.array([SIGMA_GAIN if ev is None else SIGMA_METERED for ev in metered_ev])
    known = sigma == SIGMA_METERED
    told[known] -= told[known].mean() if known.any() else 0.0
    weight = np.concatenate([np.full(len(s.ratio), SIGMA_PAIR**-2.0 / len(s.ratio)) for s in samples])
    sigma = np.r_[sigma, np.full(size - count, SIGMA_FALLOFF)]
    told = np.r_[told, np.zeros(size - count)]
    green = _least_absolute(design, -ratio[:, 1], weight, told, sigma)
    exposures = design[:, :count].tocsr()
    none, balance = np.zeros(count), np.full(count, SIGMA_BALANCE)
    logs = [green[:count]] * 3
    for c in (0, 2):
        logs[c] = green[:count] + _least_absolute(exposures, ratio[:, 1] - ratio[:, c], weight, none, balance)
    gains = np.stack(logs, axis=1)
    falloff = green[count:].reshape(-1, TERMS)[camera_of]
    return Light(np.asarray(np.exp(gains - gains.mean(axis=0))), falloff)


def _least_absolute(design: csr_matrix, measured: Array, weight: Array, told: Array, sigma: Array) -> Array:
    """x of design · x = measured with the least sum of absolute differences beyond SOFT; x = told ± sigma."""
    robust = np.ones(len(measured))
    x = np.zeros(design.shape[1])
    for _ in range(ROUNDS):
        weighted = design.multiply((robust * weight)[:, None]).tocsr()
        A = (design.T @ weighted).toarray() + np.diag(sigma**-2.0)
        x = solve_positive(A, weighted.T @ measured + told / sigma**2)
        robust = 1.0 / np.maximum(np.abs(design @ x - measured) / SOFT, 1.0)
    return x


def _linear_small(pixels: Pixels) -> Floats:
    """(h, w, 3) linear light; averaged in sRGB over 2 pixels, then in linear light."""
    height, width = pixels.shape[:2]
    half = cv2.resize(pixels, (max(width // 2, 1), max(height // 2, 1)), interpolation=cv2.INTER_AREA)
    size = (max(width // SHRINK, 1), max(height // SHRINK, 1))
    return np.asarray(cv2.resize(cv2.LUT(half, srgb_to_linear()), size, interpolation=cv2.INTER_AREA))


@dataclass(frozen=True)
class _Overlap:
    a: int
    b: int
    ratio: Array  # (S, 3) log(light a / light b)
    rho2: tuple[Array, Array]  # (S,) in a and in b


def _overlap(i: int, j: int, views: Sequence[View], small: Sequence[Floats]) -> _Overlap:
    a, b = views[i], views[j]
    w, h = a.camera.width_px - 1.0, a.camera.height_px - 1.0
    x, y = np.meshgrid(np.linspace(0, w, SAMPLES), np.linspace(0, h, SAMPLES))
    uv = a.to_plane(np.column_stack([x.ravel(), y.ravel()]))
    light_a, at_a, inside_a = _sample(small[i], a, uv)
    light_b, at_b, inside_b = _sample(small[j], b, uv)
    light = np.concatenate([light_a, light_b], axis=1)
    good = inside_a & inside_b & (light.min(axis=1) > 0.004) & (light.max(axis=1) < 0.9)
    ratio = np.log(light_a[good] / light_b[good])
    rho2_a, rho2_b = (np.asarray(_rho2(at[good], of), np.float64) for at, of in ((at_a, a), (at_b, b)))
    return _Overlap(i, j, ratio, (rho2_a, rho2_b))


def _sample(light: Floats, view: View, uv: Array) -> tuple[Array, Array, npt.NDArray[np.bool_]]:
    """(N, 3) light, (N, 2) photo pixels and whether they are in the photo."""
    with np.errstate(invalid="ignore"):
        photo = np.nan_to_num(view.to_photo(uv), nan=-1e6)
    scale = np.array([light.shape[1] / view.camera.width_px, light.shape[0] / view.camera.height_px])
    at = (photo + 0.5) * scale - 0.5
    inside = ((at >= 0) & (at <= np.array([light.shape[1] - 1, light.shape[0] - 1]))).all(axis=1)
    x, y = at.astype(np.float32).T
    values = cv2.remap(light, x[:, None], y[:, None], cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    return values.reshape(-1, 3).astype(np.float64), photo, inside
