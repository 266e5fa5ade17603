"""What a TIFF says of itself, without its pixels: its size, its scale, and which of it is blank."""

import math
import struct
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import tifffile

SCALE, TRANSFORMATION, NODATA = 33550, 34264, 42113  # ModelPixelScale, ModelTransformation, GDAL_NODATA
SOFTWARE = "hairline"  # in the tag Software of what it writes
PROJECTED, WEB_MERCATOR = 1, 3857  # of GTModelType; a map whose metres are none but on the equator
METRES = {9001: 1.0, 9002: 0.3048, 9003: 1200 / 3937}  # of ProjLinearUnits (EPSG)
ALPHA = (1, 2)  # of ExtraSamples: transparency, premultiplied or not; any other is a band more
COARSEST_MM_PX = 100.0  # no crack is looked for in a coarser one: its unit is none of ours


@dataclass(frozen=True)
class Told:
    width_px: int
    height_px: int
    transparent: bool  # 8-bit with an alpha channel
    placed: bool  # it has a place on a map or a plane: no photo has
    gsd_mm_px: float | None  # of a metric plane with square pixels
    nodata: int | None  # value of every channel where it is blank


def told_by(path: Path) -> Told | None:
    """None where it is no TIFF, or a damaged one."""
    try:
        with tifffile.TiffFile(path) as file:
            page: Any = file.pages[0]
            nodata = page.tags.get(NODATA)
            return Told(
                int(page.imagewidth),
                int(page.imagelength),
                page.bitspersample == 8 and any(kind in ALPHA for kind in page.extrasamples),
                SCALE in page.tags or TRANSFORMATION in page.tags,
                _gsd_mm_px(page),
                None if nodata is None else _level(nodata.value),
            )
    except (OSError, ValueError, IndexError, KeyError, TypeError, struct.error, tifffile.TiffFileError):
        return None


def made_here(path: Path) -> int | None:
    """Channels of a mosaic, coverage or source that Hairline wrote; None for any other file."""
    try:
        with tifffile.TiffFile(path) as file:
            page: Any = file.pages[0]
            return int(page.samplesperpixel) if page.software == SOFTWARE else None
    except (OSError, ValueError, IndexError, KeyError, TypeError, struct.error, tifffile.TiffFileError):
        return None


def _level(text: object) -> int | None:
    try:
        return int(float(str(text)))
    except (ValueError, OverflowError):  # nan, or no number
        return None


def _gsd_mm_px(page: Any) -> float | None:
    """Without keys the plane is one in metres, as ours are."""
    steps = _steps(page)
    keys = page.geotiff_tags if page.is_geotiff else {}
    if steps is None or int(keys.get("GTModelTypeGeoKey", PROJECTED)) != PROJECTED:
        return None
    if int(keys.get("ProjectedCSTypeGeoKey", 0)) == WEB_MERCATOR:
        return None
    metres = METRES.get(int(keys.get("ProjLinearUnitsGeoKey", 9001)))
    square = all(math.isfinite(step) and step > 0 for step in steps) and math.isclose(*steps, rel_tol=0.01)
    if metres is None or not square:
        return None
    gsd_mm_px = 1000.0 * metres * math.sqrt(steps[0] * steps[1])
    return gsd_mm_px if gsd_mm_px <= COARSEST_MM_PX else None


def _steps(page: Any) -> tuple[float, float] | None:
    """From a column and from a row to the next, in the plane's unit."""
    if (scale := page.tags.get(SCALE)) is not None:
        return float(scale.value[0]), float(scale.value[1])
    if (matrix := page.tags.get(TRANSFORMATION)) is not None:
        m = [float(value) for value in matrix.value]
        return math.hypot(m[0], m[4]), math.hypot(m[1], m[5])
    return None
