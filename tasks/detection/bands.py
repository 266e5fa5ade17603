"""An image of any size, worked on in bands of rows: the result is that of the whole image at once."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

from schemas.raster import Progress

BAND_PX = 512  # rows of a band; with a halo of 100 px a fifth of the work is done twice
WORKERS = 2  # bands at a time: bounds the memory

T = TypeVar("T")


def by_bands(
    height_px: int, halo_px: int, work: Callable[[int, int, int, int], T], on_progress: Progress | None = None
) -> list[T]:
    """`work(y0, y1, top, bottom)` for each band y0..y1, which may look at rows top..bottom around it.

    OpenCV and numpy free the interpreter, so that bands run at the same time; their results come in order.
    """
    starts = range(0, height_px, BAND_PX)

    def one(y0: int) -> T:
        y1 = min(height_px, y0 + BAND_PX)
        return work(y0, y1, max(0, y0 - halo_px), min(height_px, y1 + halo_px))

    results: list[T] = []
    with ThreadPoolExecutor(WORKERS) as pool:
        for done in pool.map(one, starts):
            results.append(done)
            if on_progress is not None:
                on_progress(len(results) / len(starts))
    return results
