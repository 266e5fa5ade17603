"""Which way a point's surroundings brighten, and how they look turned so (Lowe 2004, sections 5 and 6)."""

import numba
import numpy as np
import numpy.typing as npt

from tasks.photos.scale_space import LAYERS, SIGMA, Octave, Points

DIRECTIONS = 36  # of the gradients around a point, from which its own are taken
TURN_SIGMA, TURN_REACH = 1.5, 3.0  # their weights' 1σ in the point's own, and how far these reach, in that
AS_STRONG = 0.8  # as the strongest: a direction of its own
CELLS, BINS = 4, 8  # of a descriptor, along each side, and directions in each
CELL = 3.0  # width in the point's own σ
CLIPPED = 0.2  # no gradient counts more: light may change without linear effect

Floats = npt.NDArray[np.float32]


def described(space: list[Octave], points: Points, most: int) -> tuple[npt.NDArray[np.intp], Floats, Floats]:
    """Of the first `most` pairs of a point and a direction: the point's index, direction (radians, from x
    towards y), descriptor (CELLS² · BINS) of unit length."""
    which: list[npt.NDArray[np.intp]] = []
    turns: list[Floats] = []
    for number, layers in enumerate(space):
        mine = np.flatnonzero(points.octave == number)
        x, y = points.x[mine] / 2.0**number, points.y[mine] / 2.0**number
        row, turn = _turns(layers, x, y, points.layer[mine])
        which.append(mine[row])
        turns.append(turn)
    pairs, found = np.concatenate(which), np.concatenate(turns)
    first = np.argsort(pairs, kind="stable")[:most]
    index, angle = pairs[first], found[first]
    descriptors = np.empty((len(first), CELLS * CELLS * BINS), np.float32)
    for number, layers in enumerate(space):
        mine = np.flatnonzero(points.octave[index] == number)
        x, y = points.x[index[mine]] / 2.0**number, points.y[index[mine]] / 2.0**number
        descriptors[mine] = _descriptors(layers, x, y, points.layer[index[mine]], angle[mine])
    return index, angle, descriptors


@numba.njit(cache=True, nogil=True, inline="always", error_model="numpy")
def _angle(y: np.float32, x: np.float32) -> np.float32:
    """atan2 to 2e-4 rad, without branches (by the polynomial of OpenCV's fastAtan2)."""
    a, b = x if x > 0 else -x, y if y > 0 else -y
    less, more = a if a < b else b, b if a < b else a
    t = less / (more + np.float32(1e-12))
    s = t * t
    turn = (np.float32(-0.04432655) * s + np.float32(0.1555786)) * s - np.float32(0.3258083)
    turn = (turn * s + np.float32(0.9997878)) * t
    turn = np.float32(0.5 * np.pi) - turn if b > a else turn
    turn = np.float32(np.pi) - turn if x < 0 else turn
    return -turn if y < 0 else turn


@numba.njit(cache=True, nogil=True, error_model="numpy")  # Python's, which minds zeros, does one at a time
def _gradients(
    grey: Floats, j: int, first: int, last: int, per_turn: float, strength: Floats, turn: Floats
) -> None:
    """Of row j from pixel `first` on, before `last`; of `turn` the whole is `per_turn`."""
    above, own, below = grey[j - 1, first:last], grey[j, first - 1 : last + 1], grey[j + 1, first:last]
    per_rad = np.float32(per_turn / (2.0 * np.pi))
    for n in range(len(above)):
        dx, dy = own[n + 2] - own[n], below[n] - above[n]
        strength[n] = np.sqrt(dx * dx + dy * dy)
        turn[n] = _angle(dy, dx) * per_rad


@numba.njit(cache=True, nogil=True)
def _turns(
    layers: Octave, x: npt.NDArray[np.float64], y: npt.NDArray[np.float64], layer: npt.NDArray[np.float64]
) -> tuple[npt.NDArray[np.int64], Floats]:
    """Index and angle of every point's directions, one or more."""
    index, angle = np.empty(DIRECTIONS * len(x), np.int64), np.empty(DIRECTIONS * len(x), np.float32)
    raw, smooth, count = np.empty(DIRECTIONS), np.empty(DIRECTIONS), 0
    for n in range(len(x)):
        grey = layers[round(layer[n])]
        sigma = TURN_SIGMA * SIGMA * 2.0 ** (layer[n] / LAYERS)
        _directions(grey, x[n], y[n], sigma, raw)
        for b in range(DIRECTIONS):
            near = raw[b - 1] + raw[(b + 1) % DIRECTIONS]
            far = raw[b - 2] + raw[(b + 2) % DIRECTIONS]
            smooth[b] = (6.0 * raw[b] + 4.0 * near + far) / 16.0
        most = smooth.max()
        for b in range(DIRECTIONS):
            left, own, right = smooth[b - 1], smooth[b], smooth[(b + 1) % DIRECTIONS]
            if own > left and own > right and own >= AS_STRONG * most:
                peak = b + 0.5 * (left - right) / (left - 2.0 * own + right)
                index[count], angle[count] = n, peak * 2.0 * np.pi / DIRECTIONS
                count += 1
    return index[:count], angle[:count]


@numba.njit(cache=True, nogil=True)
def _directions(grey: Floats, x: float, y: float, sigma: float, histogram: npt.NDArray[np.float64]) -> None:
    """(DIRECTIONS,) in place: strength of the gradients around x, y, by direction."""
    height, width = grey.shape
    x0, y0, reach = int(x + 0.5), int(y + 0.5), int(TURN_REACH * sigma + 0.5)
    first, last = max(1, x0 - reach), min(width - 1, x0 + reach + 1)
    strength, turn = np.empty(2 * reach + 1, np.float32), np.empty(2 * reach + 1, np.float32)
    across = np.exp(-((np.arange(first, last) - x) ** 2) / (2.0 * sigma**2))
    histogram[:] = 0.0
    for j in range(max(1, y0 - reach), min(height - 1, y0 + reach + 1)):
        _gradients(grey, j, first, last, DIRECTIONS, strength, turn)
        down = np.exp(-((j - y) ** 2) / (2.0 * sigma**2))
        for n in range(last - first):
            whole = int(turn[n] + DIRECTIONS)
            share = turn[n] + DIRECTIONS - whole
            weight = down * across[n] * strength[n]
            histogram[whole % DIRECTIONS] += (1.0 - share) * weight
            histogram[(whole + 1) % DIRECTIONS] += share * weight


@numba.njit(cache=True, nogil=True)
def _descriptors(
    layers: Octave,
    x: npt.NDArray[np.float64],
    y: npt.NDArray[np.float64],
    layer: npt.NDArray[np.float64],
    angle: Floats,
) -> Floats:
    """(N, CELLS² · BINS) of unit length."""
    found = np.empty((len(x), CELLS * CELLS * BINS), np.float32)
    padded = np.empty((CELLS + 3, CELLS + 3, BINS + 1), np.float32)  # a cell around, one for rounding errors
    for n in range(len(x)):
        cell_px = CELL * SIGMA * 2.0 ** (layer[n] / LAYERS)
        padded[:] = 0.0
        _gather(layers[round(layer[n])], x[n], y[n], angle[n], cell_px, padded)
        padded[:, :, 0] += padded[:, :, BINS]
        one = found[n]
        for row in range(CELLS):
            for column in range(CELLS):
                for b in range(BINS):
                    one[(row * CELLS + column) * BINS + b] = padded[row + 1, column + 1, b]
        one /= max(np.sqrt((one * one).sum()), np.float32(1e-9))
        one[:] = np.minimum(one, np.float32(CLIPPED))
        one /= max(np.sqrt((one * one).sum()), np.float32(1e-9))
    return found


@numba.njit(cache=True, nogil=True)
def _gather(grey: Floats, x: float, y: float, angle: float, cell_px: float, padded: Floats) -> None:
    """Gradients around x, y into cells turned by `angle`, each shared among the nearest cells and directions:
    (CELLS + 3, CELLS + 3, BINS + 1), in place."""
    height, width = grey.shape
    c, s = np.cos(angle) / cell_px, np.sin(angle) / cell_px
    half, zero = 0.5 * (CELLS + 1), np.float32(2 * BINS - angle * BINS / (2.0 * np.pi))
    x0, y0, reach = int(x + 0.5), int(y + 0.5), int(np.sqrt(2.0) * half * cell_px) + 2
    strength, turn = np.empty(2 * reach + 1, np.float32), np.empty(2 * reach + 1, np.float32)
    fall = -2.0 / (CELLS * cell_px) ** 2
    across = np.exp(fall * (np.arange(x0 - reach, x0 + reach + 1) - x) ** 2).astype(np.float32)
    one, du, dv = np.float32(1.0), np.float32(c), np.float32(-s)
    for j in range(max(1, y0 - reach), min(height - 1, y0 + reach + 1)):
        low, high = _inside(s * (j - y), c, half)
        least, most = _inside(c * (j - y), -s, half)
        first = max(1, int(np.ceil(x + max(low, least))))
        last = min(width - 1, int(np.floor(x + min(high, most))) + 1)
        if first >= last:
            continue
        _gradients(grey, j, first, last, BINS, strength, turn)
        down = np.float32(np.exp(fall * (j - y) ** 2))
        u = np.float32(c * (first - x) + s * (j - y) + half)  # in cells, 0 to CELLS + 1
        v = np.float32(c * (j - y) - s * (first - x) + half)
        for n in range(last - first):
            weight, b = down * across[first + n - x0 + reach] * strength[n], turn[n] + zero
            column, row, bin_ = int(u), int(v), int(b)
            right, lower, next_ = u - column, v - row, b - bin_
            bin_ &= BINS - 1
            left, upper = one - right, (one - lower) * weight
            lower *= weight
            u, v = u + du, v + dv
            _add(padded[row, column], bin_, next_, upper * left)
            _add(padded[row, column + 1], bin_, next_, upper * right)
            _add(padded[row + 1, column], bin_, next_, lower * left)
            _add(padded[row + 1, column + 1], bin_, next_, lower * right)


@numba.njit(cache=True, nogil=True, inline="always")
def _add(bins: Floats, first: int, to_next: np.float32, weight: np.float32) -> None:
    """To a direction and the next one."""
    bins[first] += weight * (np.float32(1.0) - to_next)
    bins[first + 1] += weight * to_next


@numba.njit(cache=True, nogil=True)
def _inside(start: float, slope: float, half: float) -> tuple[float, float]:
    """From where to where |start + slope · t| stays below half."""
    if abs(slope) < 1e-9:
        return (-1e6, 1e6) if abs(start) < half else (1.0, 0.0)
    one, other = (-half - start) / slope, (half - start) / slope
    return min(one, other) + 1e-6, max(one, other) - 1e-6
