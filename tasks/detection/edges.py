"""A crack has sharp edges: right beside it the surface is as bright as a little further away. The middle of a
stain, a rust run or a soft shadow is dark as well, but brightens slowly."""

from collections.abc import Iterator

import cv2
import numpy as np
import numpy.typing as npt

from schemas.bit_mask import BitMask
from schemas.raster import Raster
from tasks.connected import Indices, Marked
from tasks.detection.components import components
from tasks.detection.sauvola import Grey, Mask, grey_of

BESIDE_PX = (3.0, 6.0)  # distances from the component's rim that count as right beside it
FURTHER_PX = (10.0, 16.0)  # and as further away
NARROW_PX = 12.0  # what is wider is seen from nearer, and less sharp: both in proportion, as far as
WIDEST = 4.0  # times as far; beyond, all sorts of things lie
SHARP = 0.7  # least share of the contrast that is reached right beside it; of 99 in 100 real cracks .78 is
ENOUGH_PX = 10  # pixels that a ring must have to be judged by
TILE_PX = 1024  # of a component that are looked at together


def without_soft(pixels: Marked, raster: Raster, dark: BitMask) -> tuple[Marked, list[tuple[float, float]]]:
    """`pixels` less the components whose edges are soft, and where these were (x, y).

    dark: pixels that say nothing about the brightness beside a component."""
    found = components(pixels)
    sharp = np.ones(len(found.area_px), dtype=bool)
    order = np.argsort(found.label, kind="stable")
    ends = np.cumsum(found.area_px).astype(np.intp)
    soft_at, width_px = [], found.width_px
    for label in range(1, len(sharp)):
        index = order[ends[label - 1] : ends[label]]
        if not _is_sharp(pixels.y[index], pixels.x[index], width_px[label], raster, dark):
            sharp[label] = False
            x, y, width, height = found.box(label)
            soft_at.append((x + width / 2, y + height / 2))
    return found.keep(sharp), soft_at


def _is_sharp(y: Indices, x: Indices, width_px: float, raster: Raster, dark: BitMask) -> bool:
    """Of the component that has these pixels, row by row."""
    core, beside, further = [], [], []
    reach = min(max(1.0, width_px / NARROW_PX), WIDEST)
    for inside, surface, grey, own in _tiles(y, x, raster, dark, int(reach * FURTHER_PX[1]) + 1):
        core.append(grey[inside & own])
        away = cv2.distanceTransform((~inside).astype(np.uint8), cv2.DIST_L2, 5) / reach
        beside.append(grey[surface & own & (away >= BESIDE_PX[0]) & (away <= BESIDE_PX[1])])
        further.append(grey[surface & own & (away >= FURTHER_PX[0]) & (away <= FURTHER_PX[1])])
    near, far = np.concatenate(beside), np.concatenate(further)
    if min(len(near), len(far)) < ENOUGH_PX:
        return True
    darkness = float(np.median(np.concatenate(core)))
    return float(near.mean()) - darkness >= SHARP * (float(far.mean()) - darkness)


def _tiles(
    y: Indices, x: Indices, raster: Raster, dark: BitMask, margin_px: int
) -> Iterator[tuple[Mask, Mask, Grey, Mask]]:
    """Piece by piece: the component's pixels, the surface around them, its grey levels, and which pixels
    belong to no other piece."""
    bottom, right = int(y[-1]) + margin_px + 1, int(x.max()) + margin_px + 1
    for top in range(max(0, int(y[0]) - margin_px), min(raster.height_px, bottom), TILE_PX):
        for left in range(max(0, int(x.min()) - margin_px), min(raster.width_px, right), TILE_PX):
            y0, y1 = max(0, top - margin_px), min(raster.height_px, bottom, top + TILE_PX + margin_px)
            x0, x1 = max(0, left - margin_px), min(raster.width_px, right, left + TILE_PX + margin_px)
            rows = slice(*np.searchsorted(y, (y0, y1)))
            here = (x[rows] >= x0) & (x[rows] < x1)
            if not here.any():
                continue
            inside: Mask = np.zeros((y1 - y0, x1 - x0), dtype=bool)
            inside[y[rows][here] - y0, x[rows][here] - x0] = True
            own: npt.NDArray[np.bool_] = np.zeros_like(inside)
            own[top - y0 : top - y0 + TILE_PX, left - x0 : left - x0 + TILE_PX] = True
            grey = grey_of(raster.rgb(y0, y1, x0, x1))  # no lit surface is black
            surface = raster.valid(y0, y1, x0, x1) & ~dark.read(y0, y1, x0, x1) & (grey > 0)
            yield inside, surface, grey, own
