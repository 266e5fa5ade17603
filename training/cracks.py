"""Cracks to learn from: drawn wider in range than those of any scene, and where a photo shows them."""

import cv2
import numpy as np
import numpy.typing as npt

from tasks.simulation.crack import CrackShape

STEP_PX = 1.0  # between the points of a crack
SUPERSAMPLED = 8  # of the truth, along each axis
VISIBLE = 0.2  # a pixel belongs to a crack that covers this share of what its blurred area sees
SMOOTH = 0.3  # share of cracks without roughness
FAINT, FAINT_RMS = 0.3, (2.0, 6.0)  # share of cracks that are so many RMS of the texture darker
LEAST_RMS = 0.02  # of any surface's texture
GAP_PX, WIDEST_PX = 10.0, 50.0  # from where on a crack is a gap, and dark; and the widest
# Shares of the heading's roughness at each correlation length in pixels: a crack goes around grains of every
# size. Chords of 8, 16, 32 and 64 px turn by 21, 25, 27 and 33° RMS with branches; real ones by 19 to 26°.
BENDS_PX = {3.0: 1.7, 10.0: 0.9, 30.0: 0.4, 100.0: 0.3}
JAGGED_DEG = (5.0, 22.0)  # RMS of the heading that such a share stands for
DOUBTFUL = 128  # in a truth: no answer is wrong here
LEAST_DARK = 1.5  # RMS of the surface around, that a stretch of crack is darker by where one can tell it
STRETCH_PX = 31  # that darkness is averaged over along a crack; the surface is looked at as far to each side

Array = npt.NDArray[np.float64]
Rng = np.random.Generator
Cracks = tuple[CrackShape, ...]


def seen(cracks: Cracks, side_px: int, side_m: float, px_m: float) -> npt.NDArray[np.float32]:
    """(side_px, side_px) share of each pixel that cracks cover, through photosite and lens."""
    fine = np.zeros((side_px * SUPERSAMPLED, side_px * SUPERSAMPLED), np.uint8)
    rim_m = 0.5 / SUPERSAMPLED * px_m  # OpenCV fills the pixels on a polygon's outline too
    for crack in cracks:
        along = np.gradient(crack.uv_m, axis=0)
        normal = np.column_stack([-along[:, 1], along[:, 0]]) / np.linalg.norm(along, axis=1)[:, None]
        left_m, right_m = (np.maximum(w - rim_m, 0.0)[:, None] for w in (crack.left_m, crack.right_m))
        left, right = crack.uv_m + normal * left_m, crack.uv_m - normal * right_m
        quads = np.stack([left[:-1], left[1:], right[1:], right[:-1]], axis=1)
        x = (quads[..., 0] - side_m / 2) / px_m + (side_px - 1) / 2
        y = (side_px - 1) / 2 - (quads[..., 1] - side_m / 2) / px_m
        points = np.rint(16 * ((np.stack([x, y], axis=-1) + 0.5) * SUPERSAMPLED - 0.5)).astype(np.int32)
        for quad in points:
            cv2.fillConvexPoly(fine, quad, 255, shift=4)
    share = cv2.resize(fine, (side_px, side_px), interpolation=cv2.INTER_AREA).astype(np.float32) / 255
    return np.asarray(cv2.GaussianBlur(share, (0, 0), 0.7), np.float32)


def told(rgb: npt.NDArray[np.float32], truth: npt.NDArray[np.uint8]) -> npt.NDArray[np.uint8]:
    """(H, W) truth, DOUBTFUL where a crack cannot be told from the texture around it: nobody should learn
    to see what is not there. rgb: (H, W, 3) in 0..1; truth: (H, W), 255 on cracks."""
    grey = np.log(rgb.mean(axis=2) + np.float32(0.02))
    crack = (truth == 255).astype(np.float32)
    free = 1.0 - cv2.dilate((truth > 0).astype(np.float32), np.ones((7, 7)))
    fine = cv2.GaussianBlur(grey, (0, 0), 1.0)

    def mean(of: npt.NDArray[np.float32], over: npt.NDArray[np.float32], size_px: int) -> Array:
        size = (size_px, size_px)
        return np.asarray(
            cv2.boxFilter(of * over, -1, size) / np.maximum(cv2.boxFilter(over, -1, size), 1e-6)
        )

    around = mean(grey, free, 2 * STRETCH_PX + 1)
    rms = np.sqrt(np.maximum(mean((fine - around) ** 2, free, 2 * STRETCH_PX + 1), 0.0))
    dark = mean(around - fine, crack, STRETCH_PX)
    least = LEAST_DARK * rms + 0.01  # of the brightness, where there is no texture at all
    return np.where((crack > 0) & (dark < least), np.uint8(DOUBTFUL), truth)


def cracks_on(rng: Rng, side_m: float, px_m: float, rms: float) -> Cracks:
    """Some cracks with their branches on a square of side_m whose photo has pixels of px_m; rms: of the
    surface's ln(brightness)."""
    cracks: list[CrackShape] = []
    for _ in range(int(rng.choice([1, 2, 3, 6], p=[0.4, 0.3, 0.2, 0.1]))):
        start, heading = rng.uniform(0.05, 0.95, 2) * side_m, rng.uniform(0, 2 * np.pi)
        trunk = one_crack(rng, start, heading, side_m, px_m, rms)
        cracks.append(trunk)
        for _ in range(rng.poisson(0.7)):
            at = int(rng.uniform(0.1, 0.9) * (len(trunk.uv_m) - 10))
            along = trunk.uv_m[at + 9] - trunk.uv_m[at]
            away = float(np.arctan2(along[1], along[0])) + rng.choice([-1, 1]) * rng.uniform(0.4, 1.4)
            cracks.append(one_crack(rng, trunk.uv_m[at], away, side_m, px_m, rms, trunk))
    return tuple(cracks)


def faint(rng: Rng, rms: float) -> float:
    """The share of light that a crack leaves which stands out little from a texture of `rms`."""
    return float(np.exp(-min(rng.uniform(*FAINT_RMS) * max(rms, LEAST_RMS), 1.5)))


def one_crack(
    rng: Rng,
    start: Array,
    heading: float,
    side_m: float,
    px_m: float,
    rms: float,
    trunk: CrackShape | None = None,
) -> CrackShape:
    n = int(rng.uniform(80, 700) if trunk is None else rng.uniform(40, 250))
    smooth = rng.random() < SMOOTH  # bends slowly: no roughness at the pixels' scale
    jagged = np.radians(np.exp(rng.uniform(*np.log(JAGGED_DEG))))
    path = np.full(n, heading)
    for bend_px, share in BENDS_PX.items():
        path += 0.0 if smooth and bend_px < 30.0 else share * jagged * walk(rng, n, bend_px)
    uv = start + STEP_PX * px_m * np.cumsum(np.column_stack([np.cos(path), np.sin(path)]), axis=0)
    inside = np.flatnonzero(((uv < 0) | (uv > side_m)).any(axis=1))
    n = int(inside[0]) if len(inside) else n
    n = max(n, 10)
    width_px = (
        float(np.exp(rng.uniform(np.log(0.7), np.log(WIDEST_PX))))
        if rng.random() < 0.35
        else (float(rng.uniform(0.8, 4.5)))
    )
    kept = float(np.exp(rng.uniform(np.log(0.12), np.log(0.8 if width_px < GAP_PX else 0.4))))
    if width_px < GAP_PX and rng.random() < FAINT:
        kept = faint(rng, rms)
    if trunk is not None:
        width_px = float(np.median(trunk.left_m + trunk.right_m)) / px_m * rng.uniform(0.35, 0.9)
        kept = float(trunk.kept_light.mean())
    s = np.linspace(0.0, 1.0, n)
    taper = np.minimum(1.0, (1.0 - s) / rng.uniform(0.05, 0.5)) ** 0.7
    if trunk is None and rng.random() < 0.7:
        taper *= np.minimum(1.0, s / rng.uniform(0.05, 0.4)) ** 0.7
    width = width_px * px_m * taper * np.exp(rng.uniform(0.1, 0.4) * walk(rng, n, rng.uniform(10, 60)))
    for _ in range(rng.poisson(0.8)):  # healed or filled for a stretch
        at, reach = rng.uniform(0, n), rng.uniform(3, 25)
        width *= 1.0 - rng.uniform(0.4, 1.0) * np.exp(-(((np.arange(n) - at) / reach) ** 2))
    rough = rng.uniform(0.0, 0.03) if smooth else rng.uniform(0.02, 0.15)
    chips_px = max(1.5, 0.3 * width_px)  # whole grains break away from the edges of a gap
    left, right = (
        np.maximum(width * (0.5 + rough * (walk(rng, n, 1.5) + walk(rng, n, chips_px))), 0.0)
        for _ in range(2)
    )
    light = np.clip(kept + min(0.06, 0.3 * (1.0 - kept)) * walk(rng, n, 40.0), 0.05, 0.95)
    return CrackShape("c", None, uv[:n], left, right, light)


def ragged_joint(rng: Rng, start: Array, end: Array, width_m: float, kept: float, px_m: float) -> CrackShape:
    """No crack: where two days' pours meet, dark and straight, with ragged edges."""
    n = int(np.linalg.norm(end - start) / (2.0 * px_m))
    along = (end - start) / np.linalg.norm(end - start)
    off_m = px_m * (rng.uniform(0.2, 1.2) * walk(rng, n, 4.0) + rng.uniform(0.3, 2.0) * walk(rng, n, 25.0))
    uv = start + np.linspace(0.0, 1.0, n)[:, None] * (end - start)
    uv += off_m[:, None] * np.array([-along[1], along[0]])
    left, right = (
        0.5 * width_m * np.exp(0.6 * walk(rng, n, rng.uniform(2.0, 12.0)) + 0.3 * walk(rng, n, 60.0))
        for _ in range(2)
    )
    return CrackShape("joint", None, uv, left, right, np.clip(kept + 0.15 * walk(rng, n, 8.0), 0.05, 0.95))


def walk(rng: Rng, n: int, length: float) -> Array:
    """(n,) Gaussian noise of unit variance, correlated over `length` samples."""
    pad = int(4 * length) + 2
    noise = cv2.GaussianBlur(rng.standard_normal((n + 2 * pad, 1)), (1, 0), sigmaX=1e-6, sigmaY=length)
    noise = noise if noise.ndim == 1 else noise[:, 0]
    return np.asarray(noise[pad : pad + n] * np.sqrt(2 * np.sqrt(np.pi) * length))
