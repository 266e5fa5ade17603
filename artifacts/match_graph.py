"""The match graph drawn on its mosaic: photos at their places, edges by how many matches hold them."""

from collections.abc import Mapping
from xml.etree import ElementTree

import cv2
import numpy as np
import numpy.typing as npt
from markupsafe import Markup

from artifacts import palette, svg
from artifacts.data_uri import jpeg_uri
from artifacts.mosaic_view import MosaicView
from schemas.mosaic import Mosaic

WIDTH, HEIGHT = 1080.0, 560.0  # at most, CSS px
LEGEND = 24.0
PALE = 0.45  # of the mosaic under the graph
BUDGET = 160_000  # bytes of the mosaic's picture
SHADES = ((20, "#9ecae1"), (60, "#4292c6"), (10**9, "#08519c"))  # edges with fewer matches than this
FALSE = "#d7301f"
STATUS = {"solved": palette.ACCENT, "placed": "#e8820c"}
MOST_LABELS = 60


def match_graph(view: MosaicView) -> Markup:
    """An SVG. Photos that are not in the mosaic have no place in it, nor have their edges."""
    mosaic = view.mosaic
    scale = min(WIDTH / mosaic.width_px, HEIGHT / mosaic.height_px)
    width, height = mosaic.width_px * scale, mosaic.height_px * scale
    root = svg.drawing(
        max(width, 620.0), height + LEGEND, f"Match graph of the photos of {mosaic.name}", class_="graph"
    )
    size = view.whole.reduced_size(round(width), round(height))
    picture = jpeg_uri(view.picture(view.whole, size), BUDGET)
    svg.add(
        root, "image", href=picture, x=0, y=0, width=width, height=height, opacity=PALE,
        preserveAspectRatio="none",
    )  # fmt: skip
    places = _places(mosaic)
    _draw_edges(root, mosaic, places, scale)
    _draw_photos(root, mosaic, places, scale)
    _draw_legend(root, height + LEGEND - 7, mosaic, places)
    return svg.text_of(root)


def _places(mosaic: Mosaic) -> dict[int, npt.NDArray[np.float64]]:
    """(2,) where the middle of each photo lies, mosaic pixels."""
    places = {}
    for k, (photo, placement) in enumerate(zip(mosaic.photos, mosaic.placements, strict=True)):
        if placement.H_mosaic_photo is not None:
            middle = [(photo.camera.width_px - 1) / 2, (photo.camera.height_px - 1) / 2, 1.0]
            x, y, w = np.array(placement.H_mosaic_photo) @ middle
            places[k] = np.array([x / w, y / w])
    return places


def _draw_edges(
    root: ElementTree.Element, mosaic: Mosaic, places: Mapping[int, npt.NDArray[np.float64]], scale: float
) -> None:
    for edge in sorted(mosaic.edges, key=lambda e: (not e.held, e.matches)):  # false ones on top
        a, b = edge.photos
        if a not in places or b not in places:
            continue
        (x1, y1), (x2, y2) = places[a] * scale, places[b] * scale
        line = svg.add(
            root, "line", x1=x1, y1=y1, x2=x2, y2=y2, stroke=_colour(edge.matches) if edge.held else FALSE,
            stroke_width=1.8 if edge.held else 1.4, **({} if edge.held else {"stroke_dasharray": "5 3"}),
        )  # fmt: skip
        names = f"{mosaic.placements[a].name} – {mosaic.placements[b].name}"
        held = "" if edge.held else ", disagrees with the other photos"
        svg.add(line, "title").text = svg.CONTROL.sub("", f"{names}: {edge.matches} matches{held}")


def _draw_photos(
    root: ElementTree.Element, mosaic: Mosaic, places: Mapping[int, npt.NDArray[np.float64]], scale: float
) -> None:
    for k, place in places.items():
        placement, (x, y) = mosaic.placements[k], place * scale
        dot = svg.add(
            root, "circle", cx=x, cy=y, r=4, fill=STATUS[placement.status], stroke="#ffffff", stroke_width=1
        )
        svg.add(dot, "title").text = svg.CONTROL.sub("", f"{placement.name}: {placement.status}")
        if len(places) <= MOST_LABELS:
            svg.write(root, str(k + 1), x=x + 6, y=y - 5, font_size=11, fill=palette.INK, font_weight=600)


def _draw_legend(root: ElementTree.Element, y: float, mosaic: Mosaic, places: Mapping[int, object]) -> None:
    x = 4.0
    low = 0
    words = []
    for below, colour in SHADES:
        words.append((colour, f"{low}–{below - 1} matches" if below < 10**9 else f"{low} and more"))
        low = below
    words += [(STATUS["solved"], "solved"), (STATUS["placed"], "placed by position alone")]
    if any(not edge.held for edge in mosaic.edges):
        words.append((FALSE, "false match"))
    for colour, text in words:
        svg.add(root, "rect", x=x, y=y - 8, width=11, height=9, rx=2, fill=colour)
        svg.write(root, text, x=x + 15, y=y, font_size=11.5, fill=palette.INK)
        x += 26 + 6.1 * len(text)


def _colour(matches: int) -> str:
    return next(colour for below, colour in SHADES if matches < below)


def edge_picture(mosaic: Mosaic, thumbnail: npt.NDArray[np.uint8], scale: float) -> npt.NDArray[np.uint8]:
    """(h, w, 3): the same on a thumbnail of the mosaic, for the dashboard, which shows no SVG."""
    drawn = np.asarray(255 - (255 - thumbnail.astype(np.float32)) * PALE, dtype=np.uint8)
    places = _places(mosaic)
    for edge in sorted(mosaic.edges, key=lambda e: (not e.held, e.matches)):
        a, b = edge.photos
        if a in places and b in places:
            ends = [tuple(int(v) for v in np.rint(places[k] * scale)) for k in (a, b)]
            colour = palette.rgb(_colour(edge.matches) if edge.held else FALSE)
            cv2.line(drawn, ends[0], ends[1], [int(c) for c in colour], 2, cv2.LINE_AA)
    for k, place in places.items():
        at = tuple(int(v) for v in np.rint(place * scale))
        colour = palette.rgb(STATUS[mosaic.placements[k].status])
        cv2.circle(drawn, at, 5, [int(c) for c in colour], -1, cv2.LINE_AA)
    return drawn
