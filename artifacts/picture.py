"""Thumbnails for the dashboard: a mosaic with a mask or lines drawn on it, as a data URI."""

import base64
from collections.abc import Iterable
from contextlib import closing
from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt

from artifacts import store
from artifacts.raster import TiffWindows, read_mask
from schemas.contract import Vector2
from schemas.file import File
from schemas.mosaic import Mosaic
from schemas.raster import Pixels

WIDEST_PX = 1200
BAND_PX = 1024


def thumbnail(mosaic: Mosaic) -> tuple[Pixels, float]:
    """(h, w, 3) RGB of the whole mosaic, and its scale against it."""
    scale = min(1.0, WIDEST_PX / max(mosaic.width_px, mosaic.height_px))
    size = (max(1, round(mosaic.width_px * scale)), max(1, round(mosaic.height_px * scale)))
    small = np.zeros((size[1], size[0], 3), dtype=np.uint8)
    with closing(TiffWindows(store.current().path(mosaic.image), mosaic.name)) as windows:
        for y0 in range(0, mosaic.height_px, BAND_PX):
            y1 = min(mosaic.height_px, y0 + BAND_PX)
            top, bottom = round(y0 * scale), round(y1 * scale)
            if bottom > top:
                band = windows.read(y0, y1, 0, mosaic.width_px)
                small[top:bottom] = cv2.resize(band, (size[0], bottom - top), interpolation=cv2.INTER_AREA)
    return small, scale


def mask_markdown(mosaic: Mosaic, mask: File, colour: tuple[int, int, int]) -> str:
    """The mosaic with the pixels of a mask tinted; what is thin stays visible."""
    picture, _ = thumbnail(mosaic)
    pixels = read_mask(store.current().path(mask), mosaic.name)
    size = (picture.shape[1], picture.shape[0])
    share = cv2.resize(pixels, size, interpolation=cv2.INTER_AREA).astype(np.float32)[..., None] / 255
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
