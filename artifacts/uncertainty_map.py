"""How well each place of a mosaic is known: the stated uncertainty of the photo that its pixels come from,
and what heights that nobody knows move them by, the more the more obliquely the photo looks: x·δh/Z."""

import io
from contextlib import closing

import cv2
import numpy as np
import numpy.typing as npt
from markupsafe import Markup
from PIL import Image

from artifacts import palette, svg
from artifacts.data_uri import png_uri
from artifacts.mosaic_view import OpenFile
from artifacts.raster import TiffWindows
from schemas.mosaic import Mosaic, PhotoPlacement

WIDTH, HEIGHT = 1080.0, 420.0  # at most, CSS px
LEGEND = 24.0
BAR = 180.0
BAND_PX = 1024
STATED_ALONE = "#bdbdbd"  # placed by its position alone: no match bounds it
STEPS = 254  # of the colour scale

Array = npt.NDArray[np.float64]


def sigma_mm(placement: PhotoPlacement) -> float | None:
    """1σ of where the photo's middle lies among the others, along the worst direction."""
    if placement.covariance_mm2 is None:
        return None
    return float(np.sqrt(max(0.0, np.linalg.eigvalsh(np.array(placement.covariance_mm2))[-1])))


def uncertainty_map(mosaic: Mosaic, open_file: OpenFile) -> Markup | None:
    """An SVG; None where no uncertainty is stated (no scale, or no match)."""
    if all(p.covariance_mm2 is None for p in mosaic.placements):
        return None
    scale = min(WIDTH / mosaic.width_px, HEIGHT / mosaic.height_px)
    width, height = mosaic.width_px * scale, mosaic.height_px * scale
    size = (min(mosaic.width_px, max(1, round(width))), min(mosaic.height_px, max(1, round(height))))
    sigmas, blank = _sigmas_mm(mosaic, open_file, size)
    if not np.isfinite(sigmas).any():
        return None
    low, high = float(np.nanmin(sigmas)), float(np.nanmax(sigmas))
    share = np.nan_to_num((sigmas - low) / (high - low)) if high - low > 1e-9 else np.full_like(sigmas, 0.5)
    levels = np.where(np.isfinite(sigmas), 2 + np.rint((STEPS - 1) * share), 1).astype(np.uint8)
    levels[blank] = 0  # 1: stated alone, 2…: the scale
    root = svg.drawing(
        max(width, 560.0), height + LEGEND, f"Position uncertainty over the mosaic of {mosaic.name}"
    )
    root.set("style", f"max-width:{svg.number(max(width, 560.0))}px")
    picture = _png(levels)
    svg.add(root, "image", href=picture, x=0, y=0, width=width, height=height, preserveAspectRatio="none")
    frame = {"fill": "none", "stroke": palette.FAINT, "stroke_width": 0.8}
    svg.add(root, "rect", x=0, y=0, width=width, height=height, **frame)
    y = height + LEGEND - 7
    svg.write(root, f"{low:.2g} mm", x=4, y=y, font_size=11.5, fill=palette.INK)
    svg.add(root, "image", href=_png(np.arange(2, 2 + STEPS, dtype=np.uint8)[None]), x=62, y=y - 9, width=BAR,
            height=10, preserveAspectRatio="none")  # fmt: skip
    svg.write(root, f"{high:.2g} mm (1σ)", x=68 + BAR, y=y, font_size=11.5, fill=palette.INK)
    if any(p.status == "placed" for p in mosaic.placements):
        svg.add(root, "rect", x=180 + BAR, y=y - 8, width=11, height=9, rx=2, fill=STATED_ALONE)
        svg.write(root, "placed by position alone", x=195 + BAR, y=y, font_size=11.5, fill=palette.INK)
    return svg.text_of(root)


def _sigmas_mm(
    mosaic: Mosaic, open_file: OpenFile, size: tuple[int, int]
) -> tuple[Array, npt.NDArray[np.bool_]]:
    """(height, width) 1σ along the worst direction, NaN where none is stated; and what is blank."""
    source = np.minimum(_sources(mosaic, open_file, size), len(mosaic.placements))
    own = [np.nan if (sigma := sigma_mm(p)) is None else sigma for p in mosaic.placements]
    sigmas = np.array([np.nan, *own])[source]
    if mosaic.height_sigma_m and mosaic.gsd_mm_px is not None:
        x = (np.arange(size[0]) + 0.5) * mosaic.width_px / size[0] * mosaic.gsd_mm_px / 1000.0
        y = (np.arange(size[1]) + 0.5) * mosaic.height_px / size[1] * mosaic.gsd_mm_px / 1000.0
        u, v = np.meshgrid(mosaic.origin_uv_m[0] + x, mosaic.origin_uv_m[1] - y)
        nowhere = (np.nan, np.nan, np.nan)
        at = [nowhere, *(p.camera_uvw_m or nowhere for p in mosaic.placements)]
        cu, cv, cw = np.array(at)[source].transpose(2, 0, 1)
        leaning = np.hypot(u - cu, v - cv) / cw
        height_mm = 1000.0 * _height_sigma_m(mosaic, open_file, u, v)
        sigmas = np.hypot(sigmas, np.nan_to_num(leaning) * height_mm)
    return sigmas, source == 0


def _height_sigma_m(mosaic: Mosaic, open_file: OpenFile, u: Array, v: Array) -> Array:
    """Of the surface over what the photos are laid on, at (height, width) places."""
    relief = mosaic.relief
    if relief is None or relief.sigmas is None:
        return np.full(u.shape, mosaic.height_sigma_m or 0.0)
    told = np.load(open_file(relief.sigmas))
    column = np.clip(np.rint((u - relief.left_m) / relief.cell_m), 0, told.shape[1] - 1).astype(np.int64)
    row = np.clip(np.rint((v - relief.bottom_m) / relief.cell_m), 0, told.shape[0] - 1).astype(np.int64)
    return np.asarray(told[row, column], np.float64)


def _sources(mosaic: Mosaic, open_file: OpenFile, size: tuple[int, int]) -> npt.NDArray[np.int64]:
    """(height, width) 1 + index of the photo that pixels come from, every so many rows and columns."""
    columns = ((np.arange(size[0]) + 0.5) * mosaic.width_px / size[0]).astype(int)
    rows = ((np.arange(size[1]) + 0.5) * mosaic.height_px / size[1]).astype(int)
    sampled = np.zeros((size[1], size[0]), np.int64)
    with closing(TiffWindows(open_file(mosaic.source), mosaic.name)) as windows:
        for y0 in range(0, mosaic.height_px, BAND_PX):
            y1 = min(mosaic.height_px, y0 + BAND_PX)
            mine = (rows >= y0) & (rows < y1)
            if mine.any():
                band = windows.read(y0, y1, 0, mosaic.width_px)
                sampled[mine] = band[rows[mine] - y0][:, columns]
    return sampled


def _png(levels: npt.NDArray[np.uint8]) -> str:
    """The colours of levels, as a palette picture."""
    picture = Image.fromarray(levels)
    ramp = cv2.applyColorMap(np.linspace(0, 255, STEPS).astype(np.uint8)[:, None], cv2.COLORMAP_VIRIDIS)
    colours = np.concatenate([[[236, 239, 242]], [palette.rgb(STATED_ALONE)], ramp[:, 0, ::-1]])
    picture.putpalette(colours.astype(np.uint8).ravel().tolist())
    stream = io.BytesIO()
    picture.save(stream, "PNG")
    return png_uri(stream.getvalue())
