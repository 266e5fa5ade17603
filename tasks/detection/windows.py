"""An image of any size, cut into windows that are worked on one by one, each with a halo around it: the
result is that of the whole image at once."""

from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from itertools import product
from typing import NamedTuple, TypeVar

from schemas.raster import Progress, Raster

MOST_PX = 3 << 20  # of a window and its halo, where by_windows cuts
STEP_PX = 64  # whose windows begin at multiples of it
WORKERS = 2  # windows at a time: bounds the memory

T = TypeVar("T")


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

    def inside(self, wider: "Window") -> tuple[slice, slice]:
        """Where it lies in an array of a wider window."""
        top, left = wider.top, wider.left
        return slice(self.top - top, self.bottom - top), slice(self.left - left, self.right - left)

    @property
    def area_px(self) -> int:
        return (self.bottom - self.top) * (self.right - self.left)


def whole_of(raster: Raster) -> Window:
    return Window(0, raster.height_px, 0, raster.width_px)


def by_windows(
    raster: Raster, halo_px: int, work: Callable[[Window, Window], T], on_progress: Progress | None = None
) -> list[T]:
    """`work(window, seen)` for each window, which may look at what is `seen` around it.

    OpenCV and numpy free the interpreter, so that windows run at the same time; results come in order."""
    image = whole_of(raster)
    most_px = max(MOST_PX, 2 * (STEP_PX + 2 * halo_px) ** 2)
    parts = list(windows(image, image, halo_px, most_px, STEP_PX))
    results: list[T] = []
    with ThreadPoolExecutor(WORKERS) as pool:
        for done in pool.map(lambda part: work(part, part.grown(halo_px, image)), parts):
            results.append(done)
            if on_progress is not None:
                on_progress(len(results) / len(parts))
    return results


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
