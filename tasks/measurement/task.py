"""Stage: measure the cracks of a mosaic in pixels and, where its scale is known, in millimetres."""

from collections.abc import Mapping
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from artifacts import store
from artifacts.mask_png import read_mask
from artifacts.page import Page, page_key
from artifacts.picture import lines_markdown
from artifacts.raster import MosaicRaster, TiffWindows
from schemas.crack import Crack, Measurement
from schemas.detection import DRAWN, Detection, Patterns
from schemas.mosaic import Mosaic
from schemas.settings import DetectSettings
from tasks.stage import progress, stage

if TYPE_CHECKING:
    from tasks.measurement.measure import MeasuredCrack

GAP_LENGTHS = 0.4  # a gap within a crack is bridged up to this share of the least length of a crack


def pages(inputs: Mapping[str, Any], measurement: Measurement) -> list[Page]:
    mosaic: Mosaic = inputs["mosaic"]
    picture = lines_markdown(mosaic, (crack.polyline_px for crack in measurement.cracks), (255, 0, 0))
    many = len(measurement.cracks)
    found = f"### {many} crack{'' if many == 1 else 's'} on {mosaic.name}"
    blur = f"Blur σ {measurement.psf_px:.2f} px; {len(measurement.rejected)} candidates rejected."
    shown = [Page(key=page_key("cracks", mosaic.name), markdown="\n\n".join([found, blur, picture]))]
    if measurement.cracks:
        shown.append(Page(key=page_key("crack-table", mosaic.name), table=_table(measurement.cracks)))
    return shown


@stage(pages=pages)
def measure(
    mosaic: Mosaic, patterns: Patterns, detection: Detection, settings: DetectSettings
) -> Measurement:
    """Centreline, length, width profile and direction of every crack, each with its uncertainty."""
    from tasks.measurement.in_the_world import crack_of
    from tasks.measurement.measure import measure_cracks

    files = store.current()
    gsd = mosaic.gsd_mm_px
    side_px = min(mosaic.height_px, mosaic.width_px)
    # Who drew a short crack meant it: from a drawn mask only specks are left out.
    least_px = settings.least_px(None if detection.method == DRAWN else gsd, side_px)
    image, coverage = files.path(mosaic.image), files.path(mosaic.coverage)
    with MosaicRaster(image, coverage, mosaic.name, files.path(patterns.mask)) as raster:
        mask = read_mask(files.path(detection.mask), mosaic.name)
        found = measure_cracks(raster, mask, least_px, GAP_LENGTHS * least_px, progress)
    photos = _photos(mosaic, files.path(mosaic.source), found.cracks)
    cracks = tuple(
        crack_of(crack, f"{mosaic.name}-C{n:03d}", mosaic, photo)
        for n, (crack, photo) in enumerate(zip(found.cracks, photos, strict=True), 1)
    )
    return Measurement(
        surface=mosaic.name,
        cracks=cracks,
        psf_px=found.psf_px,
        rejected=(*detection.rejected, *found.rejected),
    )


def _photos(mosaic: Mosaic, source: Path, cracks: "list[MeasuredCrack]") -> list[str | None]:
    """The photo that each crack's middle comes from."""
    names: list[str | None] = []
    with closing(TiffWindows(source, mosaic.name)) as windows:
        for crack in cracks:
            x, y = (int(n) for n in np.rint(crack.middle_px))
            x, y = min(max(x, 0), mosaic.width_px - 1), min(max(y, 0), mosaic.height_px - 1)
            index = int(windows.read(y, y + 1, x, x + 1)[0, 0])
            names.append(mosaic.photos[index - 1].name if 0 < index <= len(mosaic.photos) else None)
    return names


def _table(cracks: tuple[Crack, ...]) -> list[dict[str, Any]]:
    scaled = cracks[0].length_mm is not None
    if scaled:
        return [
            {
                "id": crack.id,
                "length_mm": round(crack.length_mm or 0.0),
                "width_median_mm": round(crack.width_median_mm or 0.0, 2),
                "width_max_mm": round(crack.width_max_mm or 0.0, 2),
                "at most": "yes" if crack.width_is_upper_bound else "",
                "orientation_deg": round(crack.orientation_deg),
            }
            for crack in cracks
        ]
    return [
        {
            "id": crack.id,
            "length_px": round(crack.length_px),
            "width_median_px": round(crack.width_median_px, 1),
            "width_max_px": round(crack.width_max_px, 1),
            "orientation_deg": round(crack.orientation_deg),
        }
        for crack in cracks
    ]
