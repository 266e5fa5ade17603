"""The width of a crack along it, with its uncertainty and the limits of severity."""

import numpy as np
from markupsafe import Markup

from artifacts import palette, svg
from artifacts.surface_sheet import ticks
from artifacts.view3d import nice_length
from schemas.crack import Crack
from schemas.settings import AssessSettings

WIDTH, HEIGHT = 360.0, 168.0
LEFT, RIGHT, TOP, BELOW = 40.0, 50.0, 10.0, 34.0
MOST_SAMPLES = 140
FONT = 10.5


def width_graph(crack: Crack, limits: AssessSettings) -> Markup:
    """An SVG; empty where the crack has no profile in millimetres."""
    if len(crack.widths) < 2:
        return Markup("")
    s, width, sigma = _binned(crack)
    top = 1.08 * float(max((width + sigma).max(), crack.width_max_mm or 0.0, 1e-6))
    length = max(float(s[-1]), 1e-6)
    root = svg.drawing(WIDTH, HEIGHT, f"Width along {crack.id}", class_="profile")
    colour = palette.SEVERITY[crack.severity]

    def x_of(s_mm: float) -> float:
        return LEFT + s_mm / length * (WIDTH - LEFT - RIGHT)

    def y_of(width_mm: float) -> float:
        return HEIGHT - BELOW - width_mm / top * (HEIGHT - TOP - BELOW)

    text = {"font_size": FONT, "fill": palette.INK}
    for value in ticks(0.0, top, nice_length(top / 3)):
        y = y_of(value)
        svg.add(root, "line", x1=LEFT, x2=WIDTH - RIGHT, y1=y, y2=y, stroke="#e3e8ec")
        svg.write(root, f"{value:g}", x=LEFT - 5, y=y + 3.5, text_anchor="end", **text)
    for value in ticks(0.0, length, nice_length(length / 3)):
        x = x_of(value)
        svg.add(root, "line", x1=x, x2=x, y1=HEIGHT - BELOW, y2=HEIGHT - BELOW + 4, stroke=palette.INK)
        svg.write(root, f"{value:g}", x=x, y=HEIGHT - BELOW + 15, text_anchor="middle", **text)
    lowest = -np.inf  # of the names written so far
    for name, limit in (("wide", limits.wide_mm), ("medium", limits.medium_mm), ("fine", limits.fine_mm)):
        if limit < top:
            y, ink = y_of(limit), palette.SEVERITY[name]
            svg.add(root, "line", x1=LEFT, x2=WIDTH - RIGHT, y1=y, y2=y, stroke=ink, stroke_dasharray="4 3")
            if y > lowest + FONT:
                svg.write(root, name, x=WIDTH - RIGHT + 5, y=y + 3.5, font_size=FONT, fill=ink)
                lowest = y
    upper = [(x_of(a), y_of(b)) for a, b in zip(s, width + sigma, strict=True)]
    lower = [(x_of(a), y_of(max(0.0, b))) for a, b in zip(s, width - sigma, strict=True)]
    band = svg.points([*upper, *reversed(lower)])
    svg.add(root, "polygon", points=band, fill=colour, fill_opacity=0.18)
    line = svg.points([(x_of(a), y_of(b)) for a, b in zip(s, width, strict=True)])
    svg.add(
        root, "polyline", points=line, fill="none", stroke=colour, stroke_width=1.6, stroke_linejoin="round"
    )
    svg.add(root, "line", x1=LEFT, x2=LEFT, y1=TOP, y2=HEIGHT - BELOW, stroke=palette.INK)
    base = {"y1": HEIGHT - BELOW, "y2": HEIGHT - BELOW, "stroke": palette.INK}
    svg.add(root, "line", x1=LEFT, x2=WIDTH - RIGHT, **base)
    middle = {"x": (LEFT + WIDTH - RIGHT) / 2, "y": HEIGHT - 4, "text_anchor": "middle"}
    svg.write(root, "along the crack, mm", **middle, **text)
    y_middle = (TOP + HEIGHT - BELOW) / 2
    turned = {"transform": f"rotate(-90 11 {svg.number(y_middle)})", "text_anchor": "middle"}
    svg.write(root, "width, mm", x=11, y=y_middle, **turned, **text)
    return svg.text_of(root)


def _binned(crack: Crack) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Positions, widths and their σ, mm; long profiles as means of neighbours."""
    table = np.array([(w.s_mm, w.width_mm, w.sigma_mm) for w in crack.widths])
    starts = np.unique(np.linspace(0, len(table), min(MOST_SAMPLES, len(table)), endpoint=False).astype(int))
    counts = np.diff([*starts, len(table)])
    s, width, sigma = (np.add.reduceat(table, starts, axis=0) / counts[:, None]).T
    s = s.copy()
    s[0], s[-1] = table[0, 0], table[-1, 0]
    return s, width, sigma
