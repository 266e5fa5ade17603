"""One span of 12 m along x on two piers a side; four girders under a deck; and every flat face of it that
a scanner on the ground sees."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import shapely

from tests.surfaces.scanner import Box

GROUND = Box((-15.0, -14.0, -0.5), (15.0, 14.0, 0.0))
GIRDERS_Y = (-3.0, -1.0, 1.0, 3.0)
PIERS = [(x, y) for x in (-5.0, 5.0) for y in (-2.0, 2.0)]
CRATE = Box((8.0, -7.0, 0.0), (8.4, -6.6, 0.4))  # each face smaller than any surface: an obstacle

BOXES = [
    GROUND,
    Box((-6.0, -4.0, 7.4), (6.0, 4.0, 7.65)),  # deck
    *[Box((-6.0, y - 0.2, 6.5), (6.0, y + 0.2, 7.4)) for y in GIRDERS_Y],
    *[Box((x - 0.8, -4.2, 5.7), (x + 0.8, 4.2, 6.5)) for x in (-5.0, 5.0)],  # caps
    *[Box((x - 0.5, y - 0.8, 0.0), (x + 0.5, y + 0.8, 5.7)) for x, y in PIERS],
    CRATE,
]
STATIONS = [
    (0.0, -12.0, 1.7),
    (0.0, 12.0, 1.7),
    (-13.0, -3.0, 1.7),
    (13.0, 3.0, 1.7),
    (0.0, 0.5, 1.7),
    (-2.0, -5.0, 1.7),
]


@dataclass(frozen=True)
class Face:
    """Axis-aligned: `value_m` along `axis`, facing `sign`; polygon in the other two coordinates."""

    axis: int
    sign: int
    value_m: float
    polygon: shapely.Polygon

    @property
    def normal(self) -> npt.NDArray[np.float64]:
        return self.sign * np.eye(3)[self.axis]

    @property
    def others(self) -> list[int]:
        return [k for k in range(3) if k != self.axis]


def faces() -> list[Face]:
    caps = [(-5.8, -4.2), (4.2, 5.8)]
    between = shapely.box(-6.0, 6.5, 6.0, 7.4)  # a web, in x and z; over the caps it is in shade
    found = []
    for y in GIRDERS_Y:
        found += [Face(1, sign, y + 0.2 * sign, between) for sign in (-1, 1)]
        found.append(Face(2, -1, 6.5, shapely.box(-4.2, y - 0.2, 4.2, y + 0.2)))
    edges = [-4.0, *[y + side for y in GIRDERS_Y for side in (-0.2, 0.2)], 4.0]
    found += [
        Face(2, -1, 7.4, shapely.box(-6.0, a, 6.0, b)) for a, b in zip(edges[::2], edges[1::2], strict=True)
    ]
    for x, y in PIERS:
        found += [Face(0, s, x + 0.5 * s, shapely.box(y - 0.8, 0.0, y + 0.8, 5.7)) for s in (-1, 1)]
        found += [Face(1, s, y + 0.8 * s, shapely.box(x - 0.5, 0.0, x + 0.5, 5.7)) for s in (-1, 1)]
    for low, high in caps:
        found += [Face(0, s, v, shapely.box(-4.2, 5.7, 4.2, 6.5)) for s, v in ((-1, low), (1, high))]
        found += [Face(1, s, 4.2 * s, shapely.box(low, 5.7, high, 6.5)) for s in (-1, 1)]
        piers = [
            shapely.box((low + high) / 2 - 0.5, y - 0.8, (low + high) / 2 + 0.5, y + 0.8) for y in (-2, 2)
        ]
        soffit = shapely.box(low, -4.2, high, 4.2).difference(shapely.union_all(piers))
        found.append(Face(2, -1, 5.7, soffit))
    found += [Face(0, s, 6.0 * s, _deck_end()) for s in (-1, 1)]
    found += [Face(1, s, 4.0 * s, shapely.box(-6.0, 7.4, 6.0, 7.65)) for s in (-1, 1)]
    return found


def _deck_end() -> shapely.Polygon:
    """Deck and girder ends are one face, in y and z."""
    ends = [shapely.box(y - 0.2, 6.5, y + 0.2, 7.4) for y in GIRDERS_Y]
    return shapely.union_all([shapely.box(-4.0, 7.4, 4.0, 7.65), *ends])
