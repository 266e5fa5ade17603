"""Thumbnails for the dashboard: a mosaic with a mask or lines drawn on it, as a data URI."""

import base64
from collections.abc import Callable, Iterable
from contextlib import closing
from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt

from artifacts import store
from artifacts.mask_png import read_mask
from artifacts.raster import TiffWindows
from schemas.contract import Vector2
from schemas.file import File
from schemas.mosaic import Mosaic
from schemas.raster import Pixels

WIDEST_PX = 1200
BAND_PX = 1024


def thumbnail(mosaic: Mosaic) -> tuple[Pixels, float]:
    """(h, w, 3) RGB of the whole mosaic, and its scale against it."""
    scale = min(1.0, WIDEST_PX / max(mosaic.width_px, mosaic.height_px))
    with closing(TiffWindows(store.current().path(mosaic.image), mosaic.name)) as windows:
        small = _reduced(mosaic, scale, lambda y0, y1: windows.read(y0, y1, 0, mosaic.width_px))
    return small, scale


def _reduced(mosaic: Mosaic, scale: float, rows: Callable[[int, int], Pixels]) -> Pixels:
    """(h, w[, 3]) of what `rows` reads of a mosaic's size, band by band."""
    size = (max(1, round(mosaic.width_px * scale)), max(1, round(mosaic.height_px * scale)))
    bands = []
    for y0 in range(0, mosaic.height_px, BAND_PX):
        y1 = min(mosaic.height_px, y0 + BAND_PX)
        height = round(y1 * size[1] / mosaic.height_px) - round(y0 * size[1] / mosaic.height_px)
        if height:
            bands.append(cv2.resize(rows(y0, y1), (size[0], height), interpolation=cv2.INTER_AREA))
    return np.asarray(np.concatenate(bands), dtype=np.uint8)


def mask_markdown(mosaic: Mosaic, mask: File, colour: tuple[int, int, int]) -> str:
    """The mosaic with the pixels of a mask tinted; what is thin stays visible."""
    picture, scale = thumbnail(mosaic)
    bits = read_mask(store.current().path(mask), mosaic.name)

    def white(y0: int, y1: int) -> Pixels:
        return np.where(bits.read(y0, y1, 0, bits.width_px), np.uint8(255), np.uint8(0))

    share = _reduced(mosaic, scale, white).astype(np.float32)[..., None] / 255
    tint = np.clip(4 * share, 0, 1) * 0.7
    tinted = picture * (1 - tint) + np.array(colour, dtype=np.float32) * tint
    return markdown_of(tinted.astype(np.uint8), mosaic.name)


def lines_markdown(mosaic: Mosaic, lines: Iterable[tuple[Vector2, ...]], colour: tuple[int, int, int]) -> str:
    """The mosaic with polylines (mosaic pixels) drawn on it."""
    picture, scale = thumbnail(mosaic)
    for line in lines:
        points = np.rint((np.asarray(line) + 0.5) * scale - 0.5).astype(np.int32)
        cv2.polylines(picture, [points], isClosed=False, color=colour, thickness=2, lineType=cv2.LINE_AA)
    return markdown_of(picture, mosaic.name)


def write_png(path: Path, rgb: npt.NDArray[np.uint8]) -> None:
    """Of (H, W, 3) RGB."""
    _, encoded = cv2.imencode(".png", rgb[..., ::-1])
    path.write_bytes(encoded.tobytes())


def markdown_of(rgb: npt.NDArray[np.uint8], alt: str) -> str:
    """A markdown picture (JPEG) of (H, W, 3) RGB."""
    _, encoded = cv2.imencode(".jpg", rgb[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, 80])
    return f"![{alt}](data:image/jpeg;base64,{base64.b64encode(encoded.tobytes()).decode()})"
