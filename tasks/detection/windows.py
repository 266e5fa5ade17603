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
Pieces = tuple[tuple[int, int], ...]  # start and end of each


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
    parts = list(windows(image, halo_px, most_px, STEP_PX))
    results: list[T] = []
    with ThreadPoolExecutor(WORKERS) as pool:
        for done in pool.map(lambda part: work(part, part.grown(halo_px, image)), parts):
            results.append(done)
            if on_progress is not None:
                on_progress(len(results) / len(parts))
    return results


def windows(image: Window, halo_px: int, most_px: int, step_px: int) -> Iterator[Window]:
    """Row by row: every row of the grid with every column."""
    rows, columns = grid(image, halo_px, most_px, step_px)
    for top, bottom in rows:
        for left, right in columns:
            yield Window(top, bottom, left, right)


def grid(image: Window, halo_px: int, most_px: int, step_px: int) -> tuple[Pieces, Pieces]:
    """Top and bottom of each row, left and right of each column; all but the ends are multiples of step_px.
    Of the cuts whose windows have at most most_px pixels each, halos included, one that sees the fewest
    pixels in all, in the fewest windows."""
    rows = list(_cuts(image.bottom, halo_px, step_px))
    columns = list(_cuts(image.right, halo_px, step_px))
    *_, high, wide = min(
        (
            row.seen_px * column.seen_px,
            len(row.pieces) * len(column.pieces),
            row.longest_px * column.longest_px,
            row.pieces,
            column.pieces,
        )
        for row, column in product(rows, columns)
        if row.longest_px * column.longest_px <= most_px
    )
    return high, wide


class _Cut(NamedTuple):
    pieces: Pieces
    longest_px: int  # of its pieces, with their halos
    seen_px: int  # of all its pieces together


def _cuts(end: int, halo_px: int, step_px: int) -> Iterator[_Cut]:
    """For each number of pieces that 0..end can be cut into, the cut whose longest is shortest. Pieces at an
    end have one halo only, and are longer for it: all see about the same."""

    def seen_px(at: int, stop: int) -> int:
        return min(end, stop + halo_px) - max(0, at - halo_px)

    fewest, least_px = 0, step_px + 2 * halo_px
    for room_px in range(least_px, max(least_px, end) + step_px, step_px):
        pieces, at = [], 0
        while at < end:
            stop = (max(0, at - halo_px) + room_px - halo_px) // step_px * step_px
            stop = end if seen_px(at, end) <= room_px else min(stop, end)
            pieces.append((at, stop))
            at = stop
        if fewest == 0 or len(pieces) < fewest:
            fewest = len(pieces)
            seen = [seen_px(*piece) for piece in pieces]
            yield _Cut(tuple(pieces), max(seen), sum(seen))
