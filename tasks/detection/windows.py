"""An image of any size, cut into windows that a network sees one by one, each with a halo around it."""

from collections.abc import Iterator
from itertools import product
from typing import NamedTuple

from schemas.raster import Raster


class Window(NamedTuple):
    """Rows top to bottom and columns left to right, bottom and right excluded: as a Raster is asked."""

    top: int
    bottom: int
    left: int
    right: int

    def grown(self, halo_px: int, within: "Window") -> "Window":
        return Window(
            max(within.top, self.top - halo_px),
            min(within.bottom, self.bottom + halo_px),
            max(within.left, self.left - halo_px),
            min(within.right, self.right + halo_px),
        )

    @property
    def area_px(self) -> int:
        return (self.bottom - self.top) * (self.right - self.left)


def whole_of(raster: Raster) -> Window:
    return Window(0, raster.height_px, 0, raster.width_px)


def windows(of: Window, image: Window, halo_px: int, most_px: int, step_px: int) -> Iterator[Window]:
    """Row by row; sides are multiples of step_px, but at the end. Of the cuts whose windows have at most
    most_px pixels each, halos included, the one that sees the fewest pixels in all."""
    rows = list(_cuts(of.top, of.bottom, image.bottom, halo_px, step_px))
    columns = list(_cuts(of.left, of.right, image.right, halo_px, step_px))
    _, high, wide = min(
        (row.seen_px * column.seen_px, -row.side_px, -column.side_px)
        for row, column in product(rows, columns)
        if row.longest_px * column.longest_px <= most_px
    )
    for top in range(of.top, of.bottom, -high):
        for left in range(of.left, of.right, -wide):
            yield Window(top, min(of.bottom, top - high), left, min(of.right, left - wide))


class _Cut(NamedTuple):
    side_px: int
    longest_px: int  # of its pieces, with their halos
    seen_px: int  # of all its pieces together


def _cuts(start: int, end: int, image_end: int, halo_px: int, step_px: int) -> Iterator[_Cut]:
    """Ways to cut start..end of 0..image_end into pieces of one side."""
    steps = -(-(end - start) // step_px)
    for side in sorted({step_px * -(-steps // pieces) for pieces in range(1, steps + 1)}):
        seen = [
            min(image_end, end + halo_px, at + side + halo_px) - max(0, at - halo_px)
            for at in range(start, end, side)
        ]
        yield _Cut(side, max(seen), sum(seen))
