"""What the report shows of one surface: its sheet, its cracks from near, and the paper's panels."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from markupsafe import Markup

from artifacts import atlas, precision
from artifacts.close_up import close_up
from artifacts.data_uri import jpeg_uri
from artifacts.mask_png import read_mask
from artifacts.mosaic_view import MosaicView, OpenFile, reduced_mask
from artifacts.photo_pages import PhotoPages, photo_pages
from artifacts.surface_sheet import sheet
from artifacts.width_graph import width_graph
from schemas.bit_mask import BitMask
from schemas.crack import Crack, Measurement
from schemas.detection import Detection, Patterns
from schemas.inspection import Inspection
from schemas.mosaic import Mosaic

# Bounds of all pictures of a kind together, as files; a page carries them a third larger.
SHEETS_BYTES, SHEET_BYTES = 7_000_000, 900_000
CLOSE_UPS_BYTES, CLOSE_UP_BYTES = 11_000_000, 90_000
PANELS_BYTES, PANEL_BYTES = 2_000_000, 90_000
PANEL_PX = (520, 380)
COMPACT = (520.0, 300.0)  # of the sheet of a clear surface among many


@dataclass(frozen=True)
class Seen:
    """One mosaic and everything found in it. number: in the report, from 1."""

    number: int
    mosaic: Mosaic
    patterns: Patterns | None
    detection: Detection | None
    measurement: Measurement | None
    cracks: tuple[Crack, ...]

    @property
    def anchor(self) -> str:
        return f"surface-{self.number}"


@dataclass(frozen=True)
class Card:
    """A crack from near. `anchor` is unique in the page, whatever the crack is called."""

    crack: Crack
    anchor: str
    picture: Markup
    graph: Markup
    locator: Markup


@dataclass(frozen=True)
class Panel:
    title: str
    uri: str


@dataclass(frozen=True)
class SurfacePages:
    seen: Seen
    compact: bool
    sheet: Markup
    cards: tuple[Card, ...]
    panels: tuple[Panel, ...]
    photos: PhotoPages | None  # of a mosaic; None of a photo that stands for itself


def surface_pages(
    seen: Sequence[Seen], inspection: Inspection, open_file: OpenFile
) -> Iterator[SurfacePages]:
    """One surface after the other: its mosaic is open, and its masks in memory, only while it is drawn."""
    crack_count = sum(len(one.cracks) for one in seen)
    close_up_bytes = min(CLOSE_UP_BYTES, CLOSE_UPS_BYTES // max(1, crack_count))
    sheet_bytes = min(SHEET_BYTES, SHEETS_BYTES // max(1, len(seen)))
    panel_count = sum(3 + len(one.detection.baselines) for one in seen if one.detection)
    panel_bytes = min(PANEL_BYTES, PANELS_BYTES // max(1, panel_count))
    number = 0
    for one in seen:
        anchors = {c.id: f"#crack-{number + i}" for i, c in enumerate(one.cracks, start=1)}
        compact = len(seen) > 12 and not one.cracks
        with MosaicView(one.mosaic, open_file) as view:
            mask = _mask(one, open_file)
            laid_flat = atlas.flat(one.mosaic, one.cracks)
            cards = []
            for crack in one.cracks:
                number += 1
                cards.append(
                    Card(
                        crack,
                        f"crack-{number}",
                        close_up(view, mask, crack, number, inspection.report.close_up_mm, close_up_bytes),
                        width_graph(crack, inspection.assess),
                        atlas.locator(laid_flat, crack) if laid_flat else Markup(""),
                    )
                )
            size = {"width": COMPACT[0], "height": COMPACT[1]} if compact else {}
            drawn = sheet(view, one.cracks, anchors, sheet_bytes, **size)
            wanted = inspection.report.baselines or inspection.detect.baselines
            panels = tuple(_panels(one, view, mask, open_file, panel_bytes)) if wanted else ()
            photos = photo_pages(view, open_file) if len(one.mosaic.photos) > 1 else None
        yield SurfacePages(one, compact, drawn, tuple(cards), panels, photos)


def matched(
    mosaics: Sequence[Mosaic],
    measurements: Sequence[Measurement],
    patterns: Sequence[Patterns],
    detections: Sequence[Detection],
    cracks: Sequence[Crack],
) -> list[Seen]:
    """Each mosaic with its own cracks: by their centrelines, since photos that stand for themselves may
    share a surface's name; a crack that no measurement knows goes by its surface's name."""
    owner: dict[tuple[str, object], int] = {}
    for index, measurement in enumerate(measurements):
        for crack in measurement.cracks:
            owner.setdefault((crack.surface, crack.polyline_px), index)
    by_name = {mosaic.name: index for index, mosaic in reversed(list(enumerate(mosaics)))}
    mine: list[list[Crack]] = [[] for _ in mosaics]
    for crack in cracks:
        place = owner.get((crack.surface, crack.polyline_px), by_name.get(crack.surface))
        if place is not None and place < len(mosaics):
            mine[place].append(crack)
    return [
        Seen(
            number=i + 1,
            mosaic=mosaic,
            patterns=patterns[i] if i < len(patterns) else None,
            detection=detections[i] if i < len(detections) else None,
            measurement=measurements[i] if i < len(measurements) else None,
            cracks=tuple(mine[i]),
        )
        for i, mosaic in enumerate(mosaics)
    ]


def _mask(one: Seen, open_file: OpenFile) -> BitMask:
    """Set nowhere where detection left none."""
    if one.detection is None or not one.cracks:
        return BitMask(one.mosaic.height_px, one.mosaic.width_px)
    return read_mask(open_file(one.detection.mask), one.mosaic.name)


def _panels(
    one: Seen, view: MosaicView, mask: BitMask, open_file: OpenFile, max_bytes: int
) -> Iterator[Panel]:
    """As in the paper's figures: stitched, patterns taken out, global thresholds, local threshold."""
    size = view.whole.reduced_size(*PANEL_PX)
    yield Panel("Stitched image", jpeg_uri(view.picture(view.whole, size), max_bytes))

    def panel(title: str, shown: BitMask) -> Panel:
        inverted = np.where(reduced_mask(shown, view.whole, size), 20, 250).astype(np.uint8)
        return Panel(title, jpeg_uri(inverted, max_bytes))

    if one.patterns is not None:
        yield panel("Patterns and blank areas", read_mask(open_file(one.patterns.mask), one.mosaic.name))
    if one.detection is not None:
        for name, file in one.detection.baselines:
            yield panel(name, read_mask(open_file(file), one.mosaic.name))
        yield panel(f"{one.detection.method} (this report)", mask)


def crack_numbers(crack: Crack) -> Mapping[str, str]:
    """A crack's figures as they are printed, with their units."""
    if crack.length_mm is None:
        return {
            "length": f"{crack.length_px:.0f} px",
            "width_max": f"{crack.width_max_px:.1f} px",
            "width_median": f"{crack.width_median_px:.1f} px",
        }
    bound = crack.width_is_upper_bound
    return {
        "length": f"{precision.millimetres(crack.length_mm, crack.length_sigma_mm)} mm",
        "width_max": f"{precision.millimetres(crack.width_max_mm, crack.width_sigma_mm, bound)} mm",
        "width_median": f"{precision.millimetres(crack.width_median_mm, crack.width_sigma_mm, bound)} mm",
    }
