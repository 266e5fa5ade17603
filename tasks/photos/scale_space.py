"""Points that stand out at their size: extrema of differences of Gaussians (Lowe 2004, sections 3 and 4)."""

from typing import NamedTuple

import cv2
import numba
import numpy as np
import numpy.typing as npt

LAYERS = 3  # sizes to each doubling
SIGMA = 1.6  # blur of an octave's first layer, in its pixels
OWN_SIGMA = 0.5  # of a photo's pixel
REACH = 3.0  # sigmas of a blur; OpenCV's own four take a third longer, and points lie as well
LEAST_SIDE_PX = 12  # of an octave but the first
BORDER_PX = 5
EDGE = 10.0  # ratio of curvatures from where on a point slides along an edge
STEPS = 5  # of refinement

Grey = npt.NDArray[np.float32]
Octave = npt.NDArray[np.float32]  # (LAYERS + 3, h, w) grey levels, blurred by SIGMA · 2^(layer / LAYERS)


class Points(NamedTuple):
    """(N,) each; the position is that in the picture asked about, x to the right."""

    x: npt.NDArray[np.float64]
    y: npt.NDArray[np.float64]
    octave: npt.NDArray[np.int32]
    layer: npt.NDArray[np.float64]  # of its octave, to a fraction
    response: npt.NDArray[np.float64]  # contrast, 0..1

    @property
    def sigma(self) -> npt.NDArray[np.float64]:
        """In pixels of the picture."""
        return np.asarray(SIGMA * 2.0 ** (self.octave + self.layer / LAYERS))

    def where(self, chosen: npt.NDArray[np.intp]) -> "Points":
        x, y, octave, layer, response = self
        return Points(x[chosen], y[chosen], octave[chosen], layer[chosen], response[chosen])


def octaves(grey: Grey, enlarged: float) -> list[Octave]:
    """Each half as large as the one before; grey: (H, W) levels of a photo enlarged so many times."""
    own = OWN_SIGMA * max(1.0, enlarged)
    first = _blurred(grey, own, SIGMA, np.empty_like(grey)) if own < SIGMA else grey
    found: list[Octave] = []
    while not found or min(first.shape) >= LEAST_SIDE_PX:
        layers: Octave = np.empty((LAYERS + 3, *first.shape), np.float32)
        layers[0] = first
        for k in range(1, LAYERS + 3):
            before, after = (SIGMA * 2.0 ** (n / LAYERS) for n in (k - 1, k))
            _blurred(layers[k - 1], before, after, layers[k])
        found.append(layers)
        first = np.ascontiguousarray(layers[LAYERS][::2, ::2])
    return found


def _blurred(grey: Grey, before: float, after: float, into: Grey) -> Grey:
    """From one sigma to another."""
    sigma = (after**2 - before**2) ** 0.5
    side = 2 * round(REACH * sigma) + 1
    return np.asarray(cv2.GaussianBlur(grey, (side, side), sigma, dst=into))


def extrema(space: list[Octave], contrast: float) -> Points:
    """Of at least that contrast (0..1, LAYERS times a difference's, as OpenCV counts it), and on no edge."""
    rows = [np.zeros((0, 5))]
    least = contrast * 255.0 / LAYERS
    for number, layers in enumerate(space):
        found = _refined(layers, _outstanding(layers, np.float32(0.5 * least)), least)
        found[:, :2] *= 2.0**number
        rows.append(np.insert(found, 2, number, axis=1))
    x, y, octave, layer, response = np.concatenate(rows).T
    return Points(x, y, octave.astype(np.int32), layer, response * LAYERS / 255.0)


@numba.njit(cache=True, nogil=True)
def _outstanding(layers: Octave, least: np.float32) -> npt.NDArray[np.int32]:
    """(N, 3) layer, y, x of the differences that no neighbour in space and size surpasses.

    Row by row through all layers, so that what is needed again is still at hand."""
    _, height, width = layers.shape
    found, count = np.empty((8 * width, 3), np.int32), 0
    away = np.empty((3, LAYERS + 2, width), np.float32)  # three rows of the differences
    high, low = np.empty((LAYERS + 2, width), np.float32), np.empty((LAYERS + 2, width), np.float32)
    marked = np.empty(width, np.uint8)
    for y in range(height):
        for k in range(LAYERS + 2):
            _subtract(layers[k + 1, y], layers[k, y], away[y % 3, k])
        if not BORDER_PX < y <= height - BORDER_PX:
            continue
        for k in range(LAYERS + 2):
            _span(away[0, k], away[1, k], away[2, k], high[k], low[k])
        for k in range(1, LAYERS + 1):
            _mark(away[(y - 1) % 3, k], high[k - 1 : k + 2], low[k - 1 : k + 2], least, marked)
            if count + width > len(found):
                found = np.concatenate((found, np.empty_like(found)))
            count = _list(marked, k, y - 1, found, count)
    return found[:count]


@numba.njit(cache=True, nogil=True)
def _list(marked: npt.NDArray[np.uint8], k: int, y: int, found: npt.NDArray[np.int32], count: int) -> int:
    for x in range(BORDER_PX, len(marked) - BORDER_PX):
        if marked[x]:
            found[count] = k, y, x
            count += 1
    return count


# All three without branches, so that many pixels are looked at together.


@numba.njit(cache=True, nogil=True)
def _subtract(upper: Grey, lower: Grey, away: Grey) -> None:
    for x in range(len(away)):
        away[x] = upper[x] - lower[x]


@numba.njit(cache=True, nogil=True)
def _span(above: Grey, own: Grey, below: Grey, high: Grey, low: Grey) -> None:
    """The highest and lowest of three rows."""
    for x in range(len(own)):
        most = above[x] if above[x] > own[x] else own[x]
        least = above[x] if above[x] < own[x] else own[x]
        high[x] = below[x] if below[x] > most else most
        low[x] = below[x] if below[x] < least else least


@numba.njit(cache=True, nogil=True)
def _mark(row: Grey, high: Grey, low: Grey, least: np.float32, marked: npt.NDArray[np.uint8]) -> None:
    """Which values reach the highest or lowest in three layers, (3, W), and three columns."""
    for x in range(1, len(row) - 1):
        top, bottom = row[x] > least, row[x] < -least
        for k in range(3):
            for dx in range(-1, 2):
                top &= row[x] >= high[k, x + dx]
                bottom &= row[x] <= low[k, x + dx]
        marked[x] = top | bottom


@numba.njit(cache=True, nogil=True)
def _refined(layers: Octave, found: npt.NDArray[np.int32], least: float) -> npt.NDArray[np.float64]:
    """(n, 4) x, y, layer, size of the difference, where the parabola through a point's neighbours peaks;
    without those that are too weak there, on an edge, or that run away."""
    rows, count = np.empty((len(found), 4)), 0
    _, height, width = layers.shape
    for n in range(len(found)):
        k, y, x = found[n]
        inside = False
        for _ in range(STEPS):
            value, g, H = _slopes(layers, k, y, x)
            off = -_solved(H, g)
            if np.abs(off).max() < 0.5:
                inside = True
                break
            if np.abs(off).max() > max(height, width):
                break
            x, y, k = x + round(off[0]), y + round(off[1]), k + round(off[2])
            if not (1 <= k <= LAYERS and BORDER_PX <= y < height - BORDER_PX):
                break
            if not BORDER_PX <= x < width - BORDER_PX:
                break
        if not inside:
            continue
        peak = value + 0.5 * (g[0] * off[0] + g[1] * off[1] + g[2] * off[2])
        trace, det = H[0, 0] + H[1, 1], H[0, 0] * H[1, 1] - H[0, 1] ** 2
        if abs(peak) < least or det <= 0.0 or trace**2 * EDGE >= (EDGE + 1.0) ** 2 * det:
            continue
        rows[count] = x + off[0], y + off[1], k + off[2], abs(peak)
        count += 1
    return rows[:count]


@numba.njit(cache=True, nogil=True)
def _slopes(
    layers: Octave, k: int, y: int, x: int
) -> tuple[float, npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """A difference of layers, and its first (3,) and second (3, 3) differences by x, y and layer."""
    g, H, v = np.empty(3), np.empty((3, 3)), np.empty((3, 3, 3))
    for dk in range(3):
        for dy in range(3):
            for dx in range(3):
                at = y + dy - 1, x + dx - 1
                v[dk, dy, dx] = layers[k + dk][at] - layers[k + dk - 1][at]
    middle = v[1, 1, 1]
    g[0] = 0.5 * (v[1, 1, 2] - v[1, 1, 0])
    g[1] = 0.5 * (v[1, 2, 1] - v[1, 0, 1])
    g[2] = 0.5 * (v[2, 1, 1] - v[0, 1, 1])
    H[0, 0] = v[1, 1, 2] + v[1, 1, 0] - 2.0 * middle
    H[1, 1] = v[1, 2, 1] + v[1, 0, 1] - 2.0 * middle
    H[2, 2] = v[2, 1, 1] + v[0, 1, 1] - 2.0 * middle
    H[0, 1] = H[1, 0] = 0.25 * (v[1, 2, 2] - v[1, 2, 0] - v[1, 0, 2] + v[1, 0, 0])
    H[0, 2] = H[2, 0] = 0.25 * (v[2, 1, 2] - v[2, 1, 0] - v[0, 1, 2] + v[0, 1, 0])
    H[1, 2] = H[2, 1] = 0.25 * (v[2, 2, 1] - v[2, 0, 1] - v[0, 2, 1] + v[0, 0, 1])
    return middle, g, H


@numba.njit(cache=True, nogil=True)
def _solved(H: npt.NDArray[np.float64], g: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """H⁻¹ g by Cramer's rule; far away where H is singular."""
    a = H[1, 1] * H[2, 2] - H[1, 2] ** 2
    b = H[0, 2] * H[1, 2] - H[0, 1] * H[2, 2]
    c = H[0, 1] * H[1, 2] - H[0, 2] * H[1, 1]
    d = H[0, 0] * H[2, 2] - H[0, 2] ** 2
    e = H[0, 1] * H[0, 2] - H[0, 0] * H[1, 2]
    f = H[0, 0] * H[1, 1] - H[0, 1] ** 2
    det = H[0, 0] * a + H[0, 1] * b + H[0, 2] * c
    if det == 0.0:
        return np.full(3, 1e9)
    solved = np.empty(3)
    solved[0] = (a * g[0] + b * g[1] + c * g[2]) / det
    solved[1] = (b * g[0] + d * g[1] + e * g[2]) / det
    solved[2] = (c * g[0] + e * g[1] + f * g[2]) / det
    return solved
