"""Stage: find the stitching markers and the blank areas, so that detection leaves them out."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from artifacts import store
from artifacts.mask_png import write_mask
from artifacts.page import Page, page_key
from artifacts.picture import mask_markdown
from artifacts.raster import MosaicRaster
from schemas.detection import Patterns
from schemas.mosaic import Mosaic
from schemas.settings import PatternSettings
from tasks.stage import progress, stage

if TYPE_CHECKING:
    from tasks.patterns.remove import Ring


def pages(inputs: Mapping[str, Any], patterns: Patterns) -> list[Page]:
    mosaic: Mosaic = inputs["mosaic"]
    picture = mask_markdown(mosaic, patterns.mask, (230, 60, 200))
    total = mosaic.width_px * mosaic.height_px
    lines = [
        f"### Patterns and blank areas of {mosaic.name}",
        f"Peaks of the red channel: {', '.join(map(str, patterns.peaks)) or 'none'}. {patterns.note}",
        f"Blank {patterns.blank_px / total:.1%}, beyond the surface {patterns.outside_px / total:.1%}, "
        f"markers {patterns.pattern_px / total:.2%}: not inspected (tinted).",
        picture,
    ]
    return [Page(key=page_key("patterns", mosaic.name), markdown="\n\n".join(lines))]


@stage(pages=pages)
def remove_patterns(mosaic: Mosaic, settings: PatternSettings) -> Patterns:
    """Blank by the coverage, off the surface by its outline, markers by their colour; the paper's peaks."""
    from tasks.patterns.remove import remove

    files = store.current()
    with MosaicRaster(files.path(mosaic.image), files.path(mosaic.coverage), mosaic.name) as raster:
        found = remove(raster, _outline_px(mosaic), settings, progress)
    with files.scratch() as folder:
        write_mask(found.masked, folder / "masked.png")
        mask = files.put(folder / "masked.png")
    return Patterns(
        **found.peaks.model_dump(),
        mask=mask,
        blank_px=found.blank_px,
        outside_px=found.outside_px,
        pattern_px=found.pattern_px,
        inspectable_px=mosaic.width_px * mosaic.height_px - found.masked.count(),
    )


def _outline_px(mosaic: Mosaic) -> "list[Ring] | None":
    """The surface's rings in mosaic pixels."""
    if mosaic.surface is None or mosaic.gsd_mm_px is None:
        return None
    per_m = 1000.0 / mosaic.gsd_mm_px
    rings = [mosaic.surface.outline_m, *mosaic.surface.holes_m]
    of_mosaic = [(np.asarray(ring) - mosaic.origin_uv_m) * (per_m, -per_m) for ring in rings]
    return [np.asarray(ring, dtype=np.float64) for ring in of_mosaic]
