"""All inspected surfaces laid flat beside each other at one scale, with their cracks; and one crack's
place on its surface."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from xml.etree import ElementTree

import numpy as np
import numpy.typing as npt
from markupsafe import Markup

from artifacts import palette, svg
from artifacts.surface_sheet import simplified
from artifacts.view3d import nice_length
from schemas.crack import Crack
from schemas.mosaic import Mosaic

WIDTH = 1080.0
TALLEST, LEAST = 330.0, 40.0  # of the highest surface
MOST_HEIGHT = 1000.0  # of all rows together, as far as names stay legible
GAP, TITLE = 26.0, 18.0
FONT = 12.0
LOCATOR_WIDTH, LOCATOR_HEIGHT, MARGIN = 360.0, 130.0, 14.0


@dataclass(frozen=True)
class Flat:
    """A surface in its own plane: outline rings and cracks in metres, u right, v up."""

    name: str
    rings: tuple[npt.NDArray[np.float64], ...]
    cracks: tuple[tuple[Crack, npt.NDArray[np.float64]], ...]

    @property
    def low(self) -> npt.NDArray[np.float64]:
        return np.asarray(np.vstack(self.rings).min(axis=0))

    @property
    def size(self) -> npt.NDArray[np.float64]:
        return np.asarray(np.vstack(self.rings).max(axis=0) - self.low)


def flat(mosaic: Mosaic, cracks: Sequence[Crack]) -> Flat | None:
    """None without a scale: there is nothing to compare its size with."""
    if not mosaic.gsd_mm_px:
        return None
    m_px = np.array([1.0, -1.0]) * mosaic.gsd_mm_px / 1000
    corners = np.array(
        [(0, 0), (mosaic.width_px, 0), (mosaic.width_px, mosaic.height_px), (0, mosaic.height_px)]
    )
    rings: tuple[npt.NDArray[np.float64], ...] = (corners * m_px + mosaic.origin_uv_m,)
    if mosaic.surface is not None:
        rings = tuple(np.asarray(r, dtype=float) for r in (mosaic.surface.outline_m, *mosaic.surface.holes_m))
    lines = tuple(
        (c, np.asarray(c.polyline_px, dtype=float).reshape(-1, 2) * m_px + mosaic.origin_uv_m) for c in cracks
    )
    return Flat(mosaic.name, rings, lines)


def atlas(surfaces: Sequence[Flat], anchors: Mapping[str, str]) -> Markup:
    """An SVG, surfaces in rows, the highest first; anchors: where each name leads to."""
    surfaces = sorted(surfaces, key=lambda s: (-round(float(s.size[1]), 2), s.name))
    widest = max(float(s.size[0]) for s in surfaces)
    highest = max(float(s.size[1]) for s in surfaces)
    scale = min((WIDTH - 4) / widest, TALLEST / highest)
    places, bottom = _packed(surfaces, scale)
    while bottom > MOST_HEIGHT and scale * highest > LEAST:
        scale *= 0.9
        places, bottom = _packed(surfaces, scale)
    total = bottom + 34
    root = svg.drawing(WIDTH, total, "All inspected surfaces at one scale", class_="atlas")
    for surface, (left, top) in zip(surfaces, places, strict=True):
        link = svg.add(root, "a", href=anchors[surface.name]) if surface.name in anchors else root
        place = {"x": left, "y": top - 5, "font_size": FONT, "font_weight": "600", "fill": palette.ACCENT}
        svg.write(link, surface.name, **place)
        _draw(root, surface, left, top, scale, 2.4)
    bar = nice_length(160 / scale)
    svg.add(root, "rect", x=2, y=total - 8, width=bar * scale, height=3, fill=palette.INK)
    svg.write(root, f"{bar:g} m", x=2, y=total - 13, font_size=FONT, fill=palette.INK)
    return svg.text_of(root)


def _packed(surfaces: Sequence[Flat], scale: float) -> tuple[list[tuple[float, float]], float]:
    """Left upper corners of the surfaces in rows, and where the last row ends."""
    x = y = row = 0.0
    places = []
    for surface in surfaces:
        width, height = (float(side) for side in surface.size * scale)
        needed = max(width, 0.6 * FONT * len(surface.name))
        if x > 0 and x + needed > WIDTH - 4:
            x, y, row = 0.0, y + row + GAP + TITLE, 0.0
        places.append((x + 2, y + TITLE))
        x, row = x + needed + GAP, max(row, height)
    return places, y + row + TITLE


def locator(surface: Flat, crack: Crack) -> Markup:
    """A small map of its surface with one crack marked."""
    room = np.array([LOCATOR_WIDTH, LOCATOR_HEIGHT]) - 2 * MARGIN
    scale = float((room / surface.size).min())
    width, height = surface.size * scale + 2 * MARGIN
    root = svg.drawing(width, height, f"Place of {crack.id} on {surface.name}", class_="locator")
    root.set("style", f"max-width:{svg.number(float(width))}px")
    one = Flat(
        surface.name, surface.rings, tuple((c, line) for c, line in surface.cracks if c.id == crack.id)
    )
    _draw(root, one, MARGIN, MARGIN, scale, 2.4)
    for _, line in one.cracks:
        middle = ((line.min(axis=0) + line.max(axis=0)) / 2 - surface.low) * scale
        radius = max(9.0, 4 + float(np.ptp(line, axis=0).max()) * scale / 2)
        if 2 * radius < height:  # a longer crack is seen without a ring
            place = {"cx": MARGIN + middle[0], "cy": height - MARGIN - middle[1]}
            svg.add(root, "circle", r=radius, fill="none", stroke=palette.INK, **place)
    return svg.text_of(root)


def _draw(
    root: ElementTree.Element, surface: Flat, left: float, top: float, scale: float, stroke: float
) -> None:
    high = surface.low[1] + surface.size[1]

    def to_page(uv: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
        return np.column_stack([left + (uv[:, 0] - surface.low[0]) * scale, top + (high - uv[:, 1]) * scale])

    path = " ".join("M" + " L".join(svg.points(to_page(ring)).split()) + " Z" for ring in surface.rings)
    svg.add(root, "path", d=path, fill="#e9edf0", fill_rule="evenodd", stroke=palette.FAINT, stroke_width=1)
    for crack, line in surface.cracks:
        svg.add(
            root,
            "polyline",
            points=svg.points(simplified(to_page(line), 0.3)),
            fill="none",
            stroke=palette.SEVERITY[crack.severity],
            stroke_width=stroke,
            stroke_linecap="round",
            stroke_linejoin="round",
        )
