"""Mosaics on disk: image, coverage and source as tiled TIFF (deflate), written tile by tile as they come."""

import json
import zlib
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import numpy as np
import numpy.typing as npt
import tifffile

TILE_PX = 256
CLASSIC_LIMIT = 3_500_000_000  # raw bytes from which on the file is a BigTIFF
LEVEL = 1  # of deflate: photos hardly compress, so quickly


class TiledTiff:
    """Takes windows in any order, each on multiples of TILE_PX, and writes a TIFF when closed. Compressed
    tiles wait in a file beside it; what never came stays zero. Same pixels, same bytes."""

    def __init__(
        self,
        path: Path,
        width_px: int,
        height_px: int,
        channels: int,
        dtype: type[np.generic],
        description: dict[str, Any],
        gsd_mm_px: float | None = None,
    ) -> None:
        self._path, self._dtype, self._gsd_mm_px = path, np.dtype(dtype), gsd_mm_px
        self._shape = (height_px, width_px) if channels == 1 else (height_px, width_px, channels)
        self._description = json.dumps(description, sort_keys=True)
        self._columns, self._rows = -(-width_px // TILE_PX), -(-height_px // TILE_PX)
        self._where: dict[int, tuple[int, int]] = {}  # tile → offset and size in the waiting file
        self._waiting = path.with_name(path.name + ".tiles")
        self._stream = self._waiting.open("wb+")

    def put(self, x: int, y: int, pixels: npt.NDArray[Any]) -> None:
        """A window whose corner is on multiples of TILE_PX; it ends on one too, or at the image's border."""
        if x % TILE_PX or y % TILE_PX:
            raise ValueError(f"window at {x}, {y} does not start on a tile")
        for top in range(0, pixels.shape[0], TILE_PX):
            for left in range(0, pixels.shape[1], TILE_PX):
                tile = pixels[top : top + TILE_PX, left : left + TILE_PX]
                index = (y + top) // TILE_PX * self._columns + (x + left) // TILE_PX
                data = self._compressed(tile)
                self._where[index] = (self._stream.seek(0, 2), len(data))
                self._stream.write(data)

    def _compressed(self, tile: npt.NDArray[Any]) -> bytes:
        full = np.zeros((TILE_PX, TILE_PX, *self._shape[2:]), self._dtype)
        full[: tile.shape[0], : tile.shape[1]] = tile
        return zlib.compress(full.tobytes(), LEVEL)

    def close(self) -> None:
        blank = self._compressed(np.zeros((0, 0, *self._shape[2:]), self._dtype))

        def tiles() -> Any:
            for index in range(self._columns * self._rows):
                if index not in self._where:
                    yield blank
                    continue
                offset, size = self._where[index]
                self._stream.seek(offset)
                yield self._stream.read(size)

        per_cm = None if self._gsd_mm_px is None else 10.0 / self._gsd_mm_px
        raw = int(np.prod(self._shape)) * self._dtype.itemsize
        with tifffile.TiffWriter(self._path, bigtiff=raw > CLASSIC_LIMIT) as writer:
            writer.write(
                tiles(),
                shape=self._shape,
                dtype=self._dtype,
                tile=(TILE_PX, TILE_PX),
                compression="zlib",
                photometric="rgb" if len(self._shape) == 3 else "minisblack",
                description=self._description,
                software="hairline",
                metadata=None,
                resolution=None if per_cm is None else (per_cm, per_cm),
                resolutionunit=None if per_cm is None else "CENTIMETER",
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
        description = {
            "gsd_mm_px": gsd_mm_px,
            "origin_uv_m": origin_uv_m,
            "frame": frame,
            "convention": "u = origin_u + x·gsd, v = origin_v − y·gsd; pixel centres at integers",
        }
        self.image, self.coverage, self.source = (
            folder / f"{name}.tif" for name in ("image", "coverage", "source")
        )
        self._files = [
            TiledTiff(self.image, width_px, height_px, 3, np.uint8, description, gsd_mm_px),
            TiledTiff(self.coverage, width_px, height_px, 1, np.uint8, description, gsd_mm_px),
            TiledTiff(self.source, width_px, height_px, 1, np.uint16, description, gsd_mm_px),
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
