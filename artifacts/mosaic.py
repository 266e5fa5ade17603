"""Mosaics on disk: image, coverage and source as tiled, pyramidal TIFF (deflate), written as tiles come."""

import json
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import cv2
import imagecodecs
import numpy as np
import numpy.typing as npt
import tifffile

from artifacts.geotiff import NODATA, SCALE, SOFTWARE

TILE_PX = 256
CLASSIC_LIMIT = 3_500_000_000  # raw bytes from which on the file is a BigTIFF
LEVEL = 1  # of deflate, by libdeflate: photos hardly compress, so quickly


@dataclass(frozen=True)
class Georeference:
    """u and v in metres of the middle of the first pixel, in the frame that `frame` names."""

    gsd_mm_px: float | None
    origin_uv_m: tuple[float, float]
    frame: str

    @property
    def description(self) -> str:
        told = {
            "gsd_mm_px": self.gsd_mm_px,
            "origin_uv_m": self.origin_uv_m,
            "frame": self.frame,
            "convention": "u = origin_u + x·gsd, v = origin_v − y·gsd; pixel centres at integers",
        }
        return json.dumps(told, sort_keys=True)

    @property
    def tags(self) -> list[tuple[int, str, int, tuple[float, ...], bool]]:
        """ModelPixelScale and ModelTiepoint of GeoTIFF (metres, first pixel's outer corner): programs for
        maps then measure in metres of the plane."""
        if self.gsd_mm_px is None:
            return []
        step, (u, v) = self.gsd_mm_px / 1000.0, self.origin_uv_m
        corner = (0.0, 0.0, 0.0, u - step / 2, v + step / 2, 0.0)
        return [(SCALE, "d", 3, (step, step, 0.0), True), (33922, "d", 6, corner, True)]


class TiledTiff:
    """Takes windows in any order, each on multiples of TILE_PX, and writes a TIFF when closed: the picture,
    then halves of it (in SubIFDs) until one fits a tile. Compressed tiles wait in a file beside it; what
    never came stays zero. Same pixels, same bytes; memory holds few tiles where neighbours come soon after
    one another."""

    def __init__(
        self,
        path: Path,
        width_px: int,
        height_px: int,
        channels: int,
        dtype: type[np.generic],
        place: Georeference,
    ) -> None:
        self._path, self._dtype, self._place = path, np.dtype(dtype), place
        self._channels = () if channels == 1 else (channels,)
        self._levels = [(height_px, width_px)]
        while max(self._levels[-1]) > TILE_PX:
            height, width = self._levels[-1]
            self._levels.append((-(-height // 2), -(-width // 2)))
        # level, row, column of a tile → offset and size in the waiting file
        self._where: dict[tuple[int, int, int], tuple[int, int]] = {}
        # of the halves: a tile that is not whole yet, and how many of its four are still to come
        self._growing: dict[tuple[int, int, int], tuple[npt.NDArray[Any], int]] = {}
        self._waiting = path.with_name(path.name + ".tiles")
        self._stream = self._waiting.open("wb+")

    def put(self, x: int, y: int, pixels: npt.NDArray[Any]) -> None:
        """A window whose corner is on multiples of TILE_PX; it ends on one too, or at the image's border."""
        if x % TILE_PX or y % TILE_PX:
            raise ValueError(f"window at {x}, {y} does not start on a tile")
        for top in range(0, pixels.shape[0], TILE_PX):
            for left in range(0, pixels.shape[1], TILE_PX):
                tile = pixels[top : top + TILE_PX, left : left + TILE_PX]
                self._keep((0, (y + top) // TILE_PX, (x + left) // TILE_PX), tile)

    def _keep(self, place: tuple[int, int, int], tile: npt.NDArray[Any]) -> None:
        full = np.zeros((TILE_PX, TILE_PX, *self._channels), self._dtype)
        full[: tile.shape[0], : tile.shape[1]] = tile
        if full.any():
            data = _packed(full)
            self._where[place] = (self._stream.seek(0, 2), len(data))
            self._stream.write(data)
        if place[0] + 1 < len(self._levels):
            self._halve(place, full)

    def _halve(self, place: tuple[int, int, int], full: npt.NDArray[Any]) -> None:
        """Into its quarter of the coarser tile: means of colours, every second of all else."""
        level, row, column = place
        coarser = (level + 1, row // 2, column // 2)
        tile, missing = self._growing.pop(coarser, (None, 0))
        if tile is None:
            rows, columns = (-(-size // TILE_PX) for size in self._levels[level])
            missing = min(2, rows - row // 2 * 2) * min(2, columns - column // 2 * 2)
            tile = np.zeros_like(full)
        if self._channels:  # an odd last row or column is averaged with itself, not with what lies beyond
            high, wide = (
                min(TILE_PX, size - TILE_PX * at)
                for size, at in zip(self._levels[level], (row, column), strict=True)
            )
            beyond = 0, TILE_PX - high, 0, TILE_PX - wide
            full = cv2.copyMakeBorder(full[:high, :wide], *beyond, cv2.BORDER_REPLICATE)
        half = TILE_PX // 2
        top, left = row % 2 * half, column % 2 * half
        tile[top : top + half, left : left + half] = (
            cv2.resize(full, (half, half), interpolation=cv2.INTER_AREA) if self._channels else full[::2, ::2]
        )
        if missing > 1:
            self._growing[coarser] = tile, missing - 1
        else:
            self._keep(coarser, tile)

    def _waiting_bytes(self, place: tuple[int, int, int]) -> bytes:
        offset, size = self._where[place]
        self._stream.seek(offset)
        return self._stream.read(size)

    def close(self) -> None:
        while self._growing:  # what never came is blank
            place = min(self._growing)
            self._keep(place, self._growing.pop(place)[0])
        blank = _packed(np.zeros((TILE_PX, TILE_PX, *self._channels), self._dtype))

        def tiles(level: int) -> Iterator[bytes]:
            height, width = self._levels[level]
            for row in range(-(-height // TILE_PX)):
                for column in range(-(-width // TILE_PX)):
                    place = (level, row, column)
                    yield self._waiting_bytes(place) if place in self._where else blank

        gsd_mm_px = self._place.gsd_mm_px
        blank_value = [(NODATA, "s", 0, "0", True)] if self._channels else []
        raw = int(np.prod((*self._levels[0], *self._channels))) * self._dtype.itemsize
        with tifffile.TiffWriter(self._path, bigtiff=raw > CLASSIC_LIMIT) as writer:
            for level, size in enumerate(self._levels):
                first = level == 0
                per_cm = None if gsd_mm_px is None else 10.0 / gsd_mm_px / 2**level
                writer.write(
                    tiles(level),
                    shape=(*size, *self._channels),
                    dtype=self._dtype,
                    tile=(TILE_PX, TILE_PX),
                    compression="zlib",
                    predictor=2 if self._channels else None,
                    photometric="rgb" if self._channels else "minisblack",
                    description=self._place.description if first else None,
                    software=SOFTWARE if first else None,
                    metadata=None,
                    resolution=None if per_cm is None else (per_cm, per_cm),
                    resolutionunit=None if per_cm is None else "CENTIMETER",
                    subifds=len(self._levels) - 1 if first else None,
                    subfiletype=0 if first else 1,
                    extratags=[*self._place.tags, *blank_value] if first else (),
                )
        self._discard()

    def _discard(self) -> None:
        self._stream.close()
        self._waiting.unlink(missing_ok=True)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if kind is None:
            self.close()
        else:
            self._discard()


def _packed(tile: npt.NDArray[Any]) -> bytes:
    """Of colours the steps along each row (TIFF's horizontal predictor): a sixth less of a photo."""
    if tile.ndim == 3:
        return _deflated(imagecodecs.delta_encode(tile, axis=1).tobytes())
    first = tile[:1, :1]
    alike = bool((tile == first).all())  # as most tiles of coverage and of sources are
    return _deflated_alike(first.tobytes(), tile.size) if alike else _deflated(tile.tobytes())


@lru_cache(maxsize=256)
def _deflated_alike(value: bytes, count: int) -> bytes:
    return _deflated(value * count)


def _deflated(data: bytes) -> bytes:
    return bytes(imagecodecs.deflate_encode(data, LEVEL))


class MosaicWriter:
    """The three files of a mosaic, side by side in a folder."""

    def __init__(
        self,
        folder: Path,
        width_px: int,
        height_px: int,
        gsd_mm_px: float | None,
        origin_uv_m: tuple[float, float],
        frame: str,
    ) -> None:
        place = Georeference(gsd_mm_px, origin_uv_m, frame)
        self.image, self.coverage, self.source = (
            folder / f"{name}.tif" for name in ("image", "coverage", "source")
        )
        self._files = [
            TiledTiff(self.image, width_px, height_px, 3, np.uint8, place),
            TiledTiff(self.coverage, width_px, height_px, 1, np.uint8, place),
            TiledTiff(self.source, width_px, height_px, 1, np.uint16, place),
        ]
        self.covered_px = 0

    def put(
        self,
        x: int,
        y: int,
        rgb: npt.NDArray[np.uint8],
        coverage: npt.NDArray[np.uint8],
        source: npt.NDArray[np.uint16],
    ) -> None:
        windows: tuple[npt.NDArray[Any], ...] = (rgb, coverage, source)
        for file, pixels in zip(self._files, windows, strict=True):
            file.put(x, y, pixels)
        self.covered_px += int(np.count_nonzero(coverage))

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        for file in self._files:
            file.__exit__(kind, error, trace)
