"""Some pixels of an image of any size, and which of them hang together: what detection and measurement keep
of a mosaic, since cracks are few."""

from collections.abc import Iterable, Iterator
from typing import NamedTuple

import cv2
import numpy as np
import numpy.typing as npt
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from schemas.bit_mask import BitMask

BAND_PX = 512  # rows that are labelled together

Indices = npt.NDArray[np.int32]


class Part(NamedTuple):
    """Some pixels: (n,) rows, columns and levels."""

    y: Indices
    x: Indices
    level: npt.NDArray[np.uint8]


class Marked(NamedTuple):
    """Pixels of an image, row by row, each row from the left. y, x: (n,); level: (n,), never 0."""

    height_px: int
    width_px: int
    y: Indices
    x: Indices
    level: npt.NDArray[np.uint8]

    @classmethod
    def gathered(cls, height_px: int, width_px: int, parts: Iterable[Part]) -> "Marked":
        """Of parts that overlap nowhere."""
        nothing = at_least(1, np.zeros((1, 1), dtype=np.uint8), 0, 0)
        y, x, level = (np.concatenate(column) for column in zip(nothing, *parts, strict=True))
        order = np.lexsort((x, y))
        return cls(height_px, width_px, y[order], x[order], level[order])

    @classmethod
    def of_levels(cls, levels: npt.NDArray[np.uint8]) -> "Marked":
        """What is not 0 in (H, W)."""
        height_px, width_px = levels.shape
        return cls.gathered(height_px, width_px, [at_least(1, levels, 0, 0)])

    @classmethod
    def of(cls, mask: BitMask) -> "Marked":
        """Level 1 where the mask is set."""
        parts = (at_least(1, band.view(np.uint8), top, 0) for top, band in mask.bands())
        return cls.gathered(mask.height_px, mask.width_px, parts)

    def where(self, chosen: npt.NDArray[np.bool_]) -> "Marked":
        """Those of them that (n,) chooses."""
        return self._replace(y=self.y[chosen], x=self.x[chosen], level=self.level[chosen])

    @property
    def mask(self) -> BitMask:
        return BitMask.at_pixels(self.height_px, self.width_px, self.y, self.x)


def at_least(least: int, levels: npt.NDArray[np.uint8], top: int, left: int) -> Part:
    """The pixels of at least that level in a window that begins at row `top` and column `left`."""
    y, x = np.nonzero(levels >= least)
    return Part(y.astype(np.int32) + np.int32(top), x.astype(np.int32) + np.int32(left), levels[y, x])


def connected(pixels: Marked, reach_px: int = 0) -> tuple[Indices, int]:
    """(n,) label of each pixel's 8-connected component, 1 and up in the order of their first pixels, and how
    many there are. Across gaps of at most 2 reach_px pixels along either axis it hangs together too."""
    label = np.zeros(len(pixels.y), dtype=np.int32)
    bands = _Bands(pixels.width_px)
    for top in range(0, pixels.height_px, BAND_PX):
        bottom = min(pixels.height_px, top + BAND_PX)
        grown = _grown(pixels, np.ones_like(pixels.level), top, bottom, reach_px)
        count, labels = cv2.connectedComponents(grown, connectivity=8)
        here = slice(*np.searchsorted(pixels.y, (top, bottom)))
        label[here] = labels[pixels.y[here] - top, pixels.x[here]] + bands.count
        bands.add(np.asarray(labels, dtype=np.int32), count - 1)
    return _in_order(bands.joined()[label])


def highest_near(pixels: Marked, reach_px: int) -> npt.NDArray[np.uint8]:
    """(n,) the highest level of all that are at most reach_px away from each along either axis."""
    highest = np.zeros_like(pixels.level)
    for top in range(0, pixels.height_px, BAND_PX):
        bottom = min(pixels.height_px, top + BAND_PX)
        here = slice(*np.searchsorted(pixels.y, (top, bottom)))
        grown = _grown(pixels, pixels.level, top, bottom, reach_px)
        highest[here] = grown[pixels.y[here] - top, pixels.x[here]]
    return highest


def _grown(
    pixels: Marked, value: npt.NDArray[np.uint8], top: int, bottom: int, reach_px: int
) -> npt.NDArray[np.uint8]:
    """(bottom - top, W): the highest value of the pixels at most reach_px away along either axis."""
    near = slice(*np.searchsorted(pixels.y, (top - reach_px, bottom + reach_px)))
    dense = np.zeros((bottom - top + 2 * reach_px, pixels.width_px), dtype=np.uint8)
    dense[pixels.y[near] - top + reach_px, pixels.x[near]] = value[near]
    side = 2 * reach_px + 1
    grown = cv2.dilate(dense, np.ones((side, side), np.uint8)) if reach_px else dense
    return np.asarray(grown[reach_px : reach_px + bottom - top], dtype=np.uint8)


class Regions(NamedTuple):
    """The 8-connected components of a mask, however much of it is set. Label 0 is none of them."""

    mask: BitMask
    area_px: npt.NDArray[np.int64]  # by label
    of_bands: Indices  # label of each component of each band

    def pixels(self, chosen: npt.NDArray[np.bool_]) -> Iterator[tuple[Indices, Indices]]:
        """Rows and columns of each of the chosen components."""
        parts, before = [], 0
        for top, band in self.mask.bands():
            count, labels = cv2.connectedComponents(band.view(np.uint8), connectivity=8)
            of_band = self.of_bands[before : before + count].copy()
            of_band[0], before = 0, before + count - 1
            y, x = np.nonzero(chosen[of_band][labels])
            parts.append(np.column_stack([of_band[labels[y, x]], y + top, x]).astype(np.int32))
        found = np.concatenate(parts)
        found = found[np.argsort(found[:, 0], kind="stable")]
        ends = np.cumsum(self.area_px[chosen])
        for one in np.split(found, ends[:-1]) if len(ends) else ():
            yield one[:, 1], one[:, 2]


def regions(mask: BitMask) -> Regions:
    bands, areas = _Bands(mask.width_px), [np.zeros(1, dtype=np.int64)]
    for _, band in mask.bands():
        count, labels, stats, _ = cv2.connectedComponentsWithStats(band.view(np.uint8), connectivity=8)
        bands.add(np.asarray(labels, dtype=np.int32), count - 1)
        areas.append(stats[1:, cv2.CC_STAT_AREA].astype(np.int64))
    joined = bands.joined()
    area = np.zeros(int(joined.max()) + 1, dtype=np.int64)
    np.add.at(area, joined, np.concatenate(areas))
    return Regions(mask, area, joined)


class _Bands:
    """Components of an image labelled band by band, and which of them are one."""

    def __init__(self, width_px: int) -> None:
        self.count = 0  # of the bands so far
        self._above = np.zeros(width_px, dtype=np.int32)  # labels of the last row
        self._pairs = [np.zeros((0, 2), dtype=np.int32)]

    def add(self, labels: Indices, count: int) -> None:
        """(h, W) labels of the band below, 1 to count."""
        first, last = (np.where(row > 0, row + self.count, 0) for row in (labels[0], labels[-1]))
        self._pairs.append(_touching(self._above, first))
        self._above, self.count = last, self.count + count

    def joined(self) -> Indices:
        """(count + 1,) label of the whole image's component that each belongs to; 0 stays 0."""
        pairs = np.concatenate(self._pairs)
        graph = coo_array((np.ones(len(pairs), dtype=np.int8), pairs.T), shape=(self.count + 1,) * 2)
        return np.asarray(connected_components(graph, directed=False)[1], dtype=np.int32)


def _touching(upper: Indices, lower: Indices) -> Indices:
    """(n, 2) labels that meet across the border of two rows."""
    met = []
    for shift in (-1, 0, 1):
        a = upper[max(0, -shift) : len(upper) - max(0, shift)]
        b = lower[max(0, shift) : len(lower) - max(0, -shift)]
        both = (a > 0) & (b > 0)
        met.append(np.column_stack([a[both], b[both]]))
    return np.unique(np.concatenate(met), axis=0).astype(np.int32)


def _in_order(part: npt.NDArray[np.integer]) -> tuple[Indices, int]:
    """Renumbered from 1 by where each appears first."""
    _, first, inverse = np.unique(part, return_index=True, return_inverse=True)
    rank = np.empty(len(first), dtype=np.int32)
    rank[np.argsort(first)] = np.arange(1, len(first) + 1, dtype=np.int32)
    return rank[inverse], len(first)
