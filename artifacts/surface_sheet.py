"""The mosaic of a surface with its cracks drawn on it, cut into strips so that a page shows it large."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from xml.etree import ElementTree

import numpy as np
import numpy.typing as npt
from markupsafe import Markup

from artifacts import palette, svg
from artifacts.data_uri import jpeg_uri
from artifacts.mosaic_view import MosaicView, Window
from artifacts.view3d import nice_length
from schemas.crack import Crack
from schemas.mosaic import Mosaic

WIDTH, HEIGHT = 1080.0, 760.0  # of a sheet at most, CSS px
LEFT, BELOW, GAP = 46.0, 24.0, 16.0  # room for the scales, and between strips
MOST_STRIPS = 6
WORTH = 1.15  # one more strip must enlarge the picture by this
SHARPNESS = 1.7  # image pixels per CSS px: for print and dense screens
FONT = 11.0

Box = tuple[float, float, float, float]


def strips(whole: Window, width: float = WIDTH, height: float = HEIGHT) -> list[Window]:
    """Long mosaics cut along their longer side, to be shown below (or beside) each other."""
    wide = whole.width_px >= whole.height_px
    best, best_scale = 1, 0.0
    for count in range(1, MOST_STRIPS + 1):
        if wide:
            scale = min(width * count / whole.width_px, height / (count * whole.height_px))
        else:
            scale = min(width / (count * whole.width_px), height * count / whole.height_px)
        if scale > WORTH * best_scale:
            best, best_scale = count, scale
    edges = np.linspace(0, whole.width_px if wide else whole.height_px, best + 1).round().astype(int)
    pairs = [(int(a), int(b)) for a, b in pairwise(edges)]
    if wide:
        return [Window(a, 0, b, whole.height_px) for a, b in pairs]
    return [Window(0, a, whole.width_px, b) for a, b in pairs]


@dataclass(frozen=True)
class Strip:
    """Where a window of the mosaic lies on the sheet."""

    window: Window
    x: float
    y: float
    scale: float  # CSS px per mosaic pixel

    def to_sheet(self, xy_px: npt.ArrayLike) -> npt.NDArray[np.float64]:
        shifted = np.asarray(xy_px, dtype=float) - (self.window.x0, self.window.y0)
        return np.asarray(shifted * self.scale + (self.x, self.y))

    @property
    def width(self) -> float:
        return self.window.width_px * self.scale

    @property
    def height(self) -> float:
        return self.window.height_px * self.scale


def sheet(
    view: MosaicView,
    cracks: Sequence[Crack],
    anchors: Mapping[str, str],
    max_bytes: int,
    width: float = WIDTH,
    height: float = HEIGHT,
) -> Markup:
    """An SVG. anchors: where the label of each crack leads to, by id; max_bytes: of all its pictures."""
    placed = _arranged(strips(view.whole, width, height), width, height)
    total_w = max(s.x + s.width for s in placed) + 14
    total_h = max(s.y + s.height for s in placed) + BELOW
    root = svg.drawing(total_w, total_h, f"Mosaic of {view.mosaic.name} with its cracks", class_="sheet")
    root.set("style", f"max-width:{svg.number(total_w)}px")
    for strip in placed:
        _draw_picture(root, strip, view, cracks, max_bytes // len(placed))
        _draw_scales(root, strip, view.mosaic)
    _draw_labels(root, placed, view.mosaic, cracks, anchors)
    return svg.text_of(root)


def _arranged(windows: list[Window], width: float, height: float) -> list[Strip]:
    wide = len(windows) == 1 or windows[0].x0 != windows[1].x0
    across, down = (1, len(windows)) if wide else (len(windows), 1)
    widest, highest = max(w.width_px for w in windows), max(w.height_px for w in windows)
    scale = min((width / across - LEFT - 14) / widest, (height / down - BELOW) / highest)
    step_x, step_y = widest * scale + LEFT + 4, highest * scale + BELOW + GAP
    return [
        Strip(window, LEFT + (0 if wide else i * step_x), 6 + (i * step_y if wide else 0), scale)
        for i, window in enumerate(windows)
    ]


def _draw_picture(
    root: ElementTree.Element, strip: Strip, view: MosaicView, cracks: Sequence[Crack], max_bytes: int
) -> None:
    window = strip.window
    size = window.reduced_size(round(strip.width * SHARPNESS), round(strip.height * SHARPNESS))
    inner = svg.add(
        root,
        "svg",
        x=strip.x,
        y=strip.y,
        width=strip.width,
        height=strip.height,
        viewBox=f"{window.x0} {window.y0} {window.width_px} {window.height_px}",
    )
    svg.add(
        inner,
        "image",
        href=jpeg_uri(view.picture(window, size), max_bytes),
        x=window.x0,
        y=window.y0,
        width=window.width_px,
        height=window.height_px,
        preserveAspectRatio="none",
    )
    for ring in _outline_px(view.mosaic):
        line = {"fill": "none", "vector_effect": "non-scaling-stroke", "points": svg.points(ring)}
        svg.add(inner, "polygon", stroke="#ffffff", stroke_width=2.5, stroke_opacity=0.8, **line)
        svg.add(inner, "polygon", stroke=palette.ACCENT, stroke_width=1.2, stroke_dasharray="6 4", **line)
    for colour, stroke_width in (("#ffffff", 4.6), (None, 2.2)):
        for crack in cracks:
            svg.add(
                inner,
                "polyline",
                points=svg.points(simplified(crack.polyline_px, 0.4 / strip.scale)),
                fill="none",
                stroke=colour or palette.SEVERITY[crack.severity],
                stroke_width=stroke_width,
                stroke_linecap="round",
                stroke_linejoin="round",
                vector_effect="non-scaling-stroke",
            )
    frame = {"fill": "none", "stroke": palette.FAINT, "stroke_width": 0.8}
    svg.add(root, "rect", x=strip.x, y=strip.y, width=strip.width, height=strip.height, **frame)


def _draw_scales(root: ElementTree.Element, strip: Strip, mosaic: Mosaic) -> None:
    """u along the lower side and v up the left one, in metres; in pixels where no scale is known."""
    per_px = mosaic.gsd_mm_px / 1000 if mosaic.gsd_mm_px else 1.0
    u0, v0 = mosaic.origin_uv_m if mosaic.gsd_mm_px else (0.0, 0.0)
    up = -1.0 if mosaic.gsd_mm_px else 1.0  # v is up, pixel rows run down
    window, bottom = strip.window, strip.y + strip.height
    step = nice_length(90 / strip.scale * per_px)
    text = {"font_size": FONT, "fill": palette.INK}
    first, last = u0 + window.x0 * per_px, u0 + window.x1 * per_px
    for u in ticks(first, last, step):
        x = strip.x + (u - first) / per_px * strip.scale
        svg.add(root, "line", x1=x, x2=x, y1=bottom, y2=bottom + 4, stroke=palette.INK)
        svg.write(root, svg.minus(f"{u:g}"), x=x, y=bottom + 15, text_anchor="middle", **text)
    top = v0 + up * window.y0 * per_px
    low, high = sorted((top, v0 + up * window.y1 * per_px))
    for v in ticks(low, high, min(step, nice_length(0.6 * (high - low)))):
        y = strip.y + up * (v - top) / per_px * strip.scale
        svg.add(root, "line", x1=strip.x - 4, x2=strip.x, y1=y, y2=y, stroke=palette.INK)
        svg.write(root, svg.minus(f"{v:g}"), x=strip.x - 7, y=y + 4, text_anchor="end", **text)


def ticks(low: float, high: float, step: float) -> list[float]:
    first = int(np.ceil(low / step - 1e-9))
    return [round(n * step, 9) + 0.0 for n in range(first, int(np.floor(high / step + 1e-9)) + 1)]


def _draw_labels(
    root: ElementTree.Element,
    placed: Sequence[Strip],
    mosaic: Mosaic,
    cracks: Sequence[Crack],
    anchors: Mapping[str, str],
) -> None:
    taken: list[Box] = []
    for crack in cracks:
        if crack.middle_px is None:
            continue
        x_px, y_px = crack.middle_px
        strip = next((s for s in placed if _holds(s.window, x_px, y_px)), placed[0])
        x, y = strip.to_sheet((x_px, y_px))
        text = short_id(crack)
        half_w = 0.32 * FONT * len(text) + 5
        box = _free_box(
            x,
            y,
            half_w,
            FONT * 0.75,
            (strip.x, strip.y, strip.x + strip.width, strip.y + strip.height),
            taken,
        )
        taken.append(box)
        colour = palette.SEVERITY[crack.severity]
        cx, cy = (box[0] + box[2]) / 2, (box[1] + box[3]) / 2
        svg.add(root, "line", x1=x, y1=y, x2=cx, y2=cy, stroke=colour, stroke_width=1)
        link = svg.add(root, "a", href=anchors[crack.id]) if crack.id in anchors else root
        size = {"width": box[2] - box[0], "height": box[3] - box[1], "rx": 3}
        svg.add(link, "rect", x=box[0], y=box[1], fill="#ffffff", stroke=colour, stroke_width=1.2, **size)
        svg.write(
            link,
            text,
            x=cx,
            y=cy + 0.36 * FONT,
            text_anchor="middle",
            font_size=FONT,
            font_weight="600",
            fill=palette.INK,
        )


def _free_box(x: float, y: float, half_w: float, half_h: float, frame: Box, taken: Sequence[Box]) -> Box:
    """The nearest place about (x, y) where a label covers no other; the first where there is none."""
    first = None
    for ring in range(1, 6):
        for dx, dy in ((1, -1), (-1, -1), (1, 1), (-1, 1), (1.4, 0), (-1.4, 0), (0, -1.5), (0, 1.5)):
            cx = x + dx * (half_w + 6 + 10 * (ring - 1))
            cy = y + dy * (half_h + 6 + 10 * (ring - 1))
            cx = min(max(cx, frame[0] + half_w), max(frame[2] - half_w, frame[0] + half_w))
            cy = min(max(cy, frame[1] + half_h), max(frame[3] - half_h, frame[1] + half_h))
            box = (cx - half_w, cy - half_h, cx + half_w, cy + half_h)
            first = first or box
            if not any(box[0] < t[2] and t[0] < box[2] and box[1] < t[3] and t[1] < box[3] for t in taken):
                return box
    assert first is not None
    return first


def _holds(window: Window, x: float, y: float) -> bool:
    return window.x0 <= x < window.x1 and window.y0 <= y < window.y1


def _outline_px(mosaic: Mosaic) -> list[npt.NDArray[np.float64]]:
    """The surface's outline and holes in mosaic pixels."""
    if mosaic.surface is None or not mosaic.gsd_mm_px:
        return []
    rings = (mosaic.surface.outline_m, *mosaic.surface.holes_m)
    to_px = np.array([1000.0, -1000.0]) / mosaic.gsd_mm_px
    return [(np.asarray(ring, dtype=float) - mosaic.origin_uv_m) * to_px for ring in rings]


def simplified(line: npt.ArrayLike, tolerance: float) -> npt.NDArray[np.float64]:
    """(M, 2) of the (N, 2) polyline, nowhere further off than `tolerance` (Douglas and Peucker)."""
    points = np.asarray(line, dtype=float).reshape(-1, 2)
    keep = np.zeros(len(points), dtype=bool)
    keep[[0, -1]] = True
    waiting = [(0, len(points) - 1)]
    while waiting:
        a, b = waiting.pop()
        if b - a < 2:
            continue
        along, off = points[b] - points[a], points[a + 1 : b] - points[a]
        foot = np.clip(off @ along / max(float(along @ along), 1e-12), 0.0, 1.0)
        distance = np.hypot(*(off - foot[:, None] * along).T)
        furthest = int(distance.argmax())
        if distance[furthest] > tolerance:
            keep[a + 1 + furthest] = True
            waiting += [(a, a + 1 + furthest), (a + 1 + furthest, b)]
    return np.asarray(points[keep])


def short_id(crack: Crack) -> str:
    """Its id without the surface's name, which stands above the sheet."""
    return crack.id.removeprefix(f"{crack.surface}-") or crack.id
