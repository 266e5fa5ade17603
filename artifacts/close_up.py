"""A crack from near: the photo, and the same with what was detected drawn over it."""

from xml.etree import ElementTree

import numpy as np
import numpy.typing as npt
from markupsafe import Markup

from artifacts import palette, svg
from artifacts.data_uri import jpeg_uri, mask_uri
from artifacts.mosaic_view import MosaicView, Window, reduced_mask
from artifacts.surface_sheet import simplified
from artifacts.view3d import nice_length
from schemas.bit_mask import BitMask
from schemas.crack import Crack

SIDE, GAP = 340.0, 14.0  # CSS px of a panel
MOST_PX = 560  # of the picture in it
UNSCALED_PX = 400  # side of the window where no scale is known
FONT = 12.0


def window_about(crack: Crack, whole: Window, side_px: int) -> Window:
    """A square about the crack where it fits in, else about its widest place; inside the mosaic."""
    line = np.asarray(crack.polyline_px, dtype=float).reshape(-1, 2)
    low, high = line.min(axis=0), line.max(axis=0)
    middle = (low + high) / 2 if (high - low).max() <= 0.9 * side_px else widest_place(crack)[0]
    x0 = int(np.clip(round(middle[0] - side_px / 2), 0, max(0, whole.x1 - side_px)))
    y0 = int(np.clip(round(middle[1] - side_px / 2), 0, max(0, whole.y1 - side_px)))
    return Window(x0, y0, min(x0 + side_px, whole.x1), min(y0 + side_px, whole.y1))


def widest_place(crack: Crack) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """Position (x, y) where the profile comes nearest to the stated greatest width, and the direction of
    the centreline there; the middle without a profile."""
    line = np.asarray(crack.polyline_px, dtype=float).reshape(-1, 2)
    lengths = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(line, axis=0).T))])
    share = 0.5
    if crack.widths and crack.width_max_mm is not None:
        s_mm = np.array([sample.s_mm for sample in crack.widths])
        nearest = np.argmin([abs(sample.width_mm - crack.width_max_mm) for sample in crack.widths])
        share = float(s_mm[nearest] / (crack.length_mm or s_mm[-1])) if s_mm[-1] > 0 else 0.5
    at = share * lengths[-1]
    position = np.array([np.interp(at, lengths, line[:, 0]), np.interp(at, lengths, line[:, 1])])
    segment = int(np.clip(np.searchsorted(lengths, at), 1, max(1, len(line) - 1)))
    direction = line[min(segment, len(line) - 1)] - line[segment - 1]
    return position, direction / max(float(np.hypot(*direction)), 1e-9)


def close_up(
    view: MosaicView, mask: BitMask, crack: Crack, number: int, side_mm: float, max_bytes: int
) -> Markup:
    """An SVG of two panels with a scale bar. mask: of the whole mosaic; number: unique in the page;
    side_mm: of the window; max_bytes: of its picture."""
    gsd_mm_px = view.mosaic.gsd_mm_px
    side_px = max(24, round(side_mm / gsd_mm_px)) if gsd_mm_px else UNSCALED_PX
    window = window_about(crack, view.whole, side_px)
    scale = SIDE / max(window.width_px, window.height_px)
    width, height = window.width_px * scale, window.height_px * scale
    root = svg.drawing(2 * width + GAP, height, f"Close-up of {crack.id}", class_="close-up")
    photo = f"photo-{number}"
    image = svg.add(
        svg.add(root, "defs"),
        "image",
        id=photo,
        href=jpeg_uri(view.picture(window, window.reduced_size(MOST_PX)), max_bytes),
        width=width,
        height=height,
        preserveAspectRatio="none",
    )
    image.set("style", "image-rendering:auto")
    for offset in (0.0, width + GAP):
        svg.add(root, "use", href=f"#{photo}", x=offset)
        frame = {"fill": "none", "stroke": palette.FAINT, "stroke_width": 0.8}
        svg.add(root, "rect", x=offset, y=0, width=width, height=height, **frame)
    _scale_bar(root, width, height, gsd_mm_px / scale if gsd_mm_px else None, 1 / scale)
    _overlay(root, window, mask, crack, width + GAP, scale)
    return svg.text_of(root)


def _overlay(
    root: ElementTree.Element, window: Window, mask: BitMask, crack: Crack, x: float, scale: float
) -> None:
    """What was detected, tinted; the centreline; and bars across the widest place."""
    colour = palette.SEVERITY[crack.severity]
    width, height = window.width_px * scale, window.height_px * scale
    part = reduced_mask(mask, window, window.reduced_size(MOST_PX))
    if part.any():
        tint = mask_uri(part, palette.rgb(colour), 0.55)
        place = {"x": x, "y": 0.0, "width": width, "height": height, "preserveAspectRatio": "none"}
        svg.add(root, "image", href=tint, **place)
    inner = svg.add(root, "svg", x=x, y=0, width=width, height=height)
    to_panel = (np.asarray(crack.polyline_px, dtype=float) + 0.5 - (window.x0, window.y0)) * scale
    line = {"points": svg.points(simplified(to_panel, 0.3)), "fill": "none"}
    svg.add(inner, "polyline", stroke="#ffffff", stroke_width=1.6, stroke_opacity=0.9, **line)
    svg.add(inner, "polyline", stroke=colour, stroke_width=0.8, **line)
    if not crack.widths:
        return
    position, direction = widest_place(crack)
    across = np.array([-direction[1], direction[0]])
    middle = (position + 0.5 - (window.x0, window.y0)) * scale
    half = crack.width_max_px * scale / 2
    for side in (-1.0, 1.0):
        near, far = middle + side * (half + 3) * across, middle + side * (half + 22) * across
        ends = {"x1": float(near[0]), "y1": float(near[1]), "x2": float(far[0]), "y2": float(far[1])}
        svg.add(inner, "line", stroke="#ffffff", stroke_width=4, stroke_linecap="round", **ends)
        svg.add(inner, "line", stroke=palette.INK, stroke_width=1.8, stroke_linecap="round", **ends)


def _scale_bar(
    root: ElementTree.Element, width: float, height: float, mm_per_unit: float | None, px_per_unit: float
) -> None:
    per_unit, unit = (mm_per_unit, "mm") if mm_per_unit else (px_per_unit, "px")
    length = nice_length(0.34 * width * per_unit)
    bar, x, y = length / per_unit, 10.0, height - 12.0
    svg.add(
        root, "rect", x=x - 5, y=y - 21, width=bar + 10, height=28, fill="#ffffff", fill_opacity=0.82, rx=3
    )
    svg.add(root, "rect", x=x, y=y - 3, width=bar, height=4, fill=palette.INK)
    place = {"x": x + bar / 2, "y": y - 8, "text_anchor": "middle"}
    svg.write(root, f"{length:g} {unit}", font_size=FONT, fill=palette.INK, **place)
