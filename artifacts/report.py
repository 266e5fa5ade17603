"""The report for the engineer: one page that works offline and on paper, and its tables for programs."""

import importlib.metadata
from collections.abc import Callable, Iterable, Mapping, Sequence
from itertools import groupby
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup

from artifacts import atlas, crack_tables, palette, precision
from artifacts.cloud_sample import cloud_sample
from artifacts.data_uri import png_uri
from artifacts.inspected_surface import Seen, SurfacePages, crack_numbers, matched, surface_pages
from artifacts.orbit import orbit_view
from artifacts.summary import Summary
from artifacts.track_picture import track_picture
from artifacts.view3d import Scene, cloud_picture, has_underside, picture
from schemas.contract import Contract
from schemas.crack import Crack, Measurement
from schemas.crack_report import CrackReport
from schemas.detection import Detection, Patterns
from schemas.file import File
from schemas.flight_log import FlightLog
from schemas.flight_plan import FlightPlan
from schemas.inspection import Inspection
from schemas.mosaic import Mosaic
from schemas.problem import LeftOut
from schemas.registered_model import RegisteredModel
from schemas.structure import Structure

DATA_FILES = ("templates/report.html", "templates/report.css", "templates/sorting.js", "templates/orbit.js")
STAGES = ("registration", "surfaces", "planning", "flight", "photos", "stitching", "patterns", "detection")
INSPECTED = "#8fc1d4"  # on the map; other surfaces are grey


def write_report(
    folder: Path,
    *,
    inspection: Inspection,
    report: CrackReport,
    mosaics: Sequence[Mosaic],
    measurements: Sequence[Measurement],
    patterns: Sequence[Patterns],
    detections: Sequence[Detection],
    structure: Structure | None,
    model: RegisteredModel | None,
    plan: FlightPlan | None,
    log: FlightLog | None,
    open_file: Callable[[File], Path],
) -> None:
    """Write index.html, cracks.csv and cracks.json into `folder`.

    mosaics, measurements, patterns and detections go together, one each. Whatever is None or empty (no scan,
    no flight, no photo, no crack) the report says so and leaves its part out. Equal inputs give equal bytes.
    """
    crack_tables.write_json(folder / "cracks.json", report)
    crack_tables.write_csv(folder / "cracks.csv", report)
    seen = matched(mosaics, measurements, patterns, detections, report.cracks)
    pages = list(surface_pages(seen, inspection, open_file))
    flats = [laid for one in seen if (laid := atlas.flat(one.mosaic, one.cracks)) is not None]
    cloud = cloud_sample(open_file(model.cloud)) if model else None
    environment = Environment(
        loader=FileSystemLoader(Path(__file__).parent / "templates"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= {"mm": precision.millimetres, "n": precision.number, "m2": precision.area_m2}
    html = environment.get_template("report.html").render(
        inspection=inspection,
        report=report,
        summary=Summary(inspection, report, seen, structure, plan, log),
        pages=pages,
        stitched=[page for page in pages if page.photos is not None],
        rows=_crack_rows(report.cracks, pages),
        map_pictures=_map(report, seen, structure),
        orbit=orbit_view(Scene(structure, plan, log, report.cracks, _inspected(seen)), cloud),
        atlas=atlas.atlas(flats, {one.mosaic.name: f"#{one.anchor}" for one in seen})
        if flats
        else Markup(""),
        not_inspected=_by_stage(report.not_inspected),
        structure=structure,
        model=model,
        cloud_picture=_cloud_picture(model, cloud),
        plan=plan,
        plan_picture=png_uri(picture(Scene(structure, plan, log))) if plan else None,
        log=log,
        track_picture=png_uri(track_picture(plan, log)) if log and log.track else None,
        whole_errors=[error for error in (log.errors if log else ()) if not error.what.startswith("leg ")],
        leg_errors=[error for error in (log.errors if log else ()) if error.what.startswith("leg ")],
        settings=_settings(inspection),
        numbers=crack_numbers,
        severity_colours=palette.SEVERITY,
        severities=palette.SEVERITIES,
        version=_version(),
    )
    (folder / "index.html").write_text(html, encoding="utf-8", errors="replace", newline="\n")


def _crack_rows(cracks: Sequence[Crack], pages: Sequence[SurfacePages]) -> list[dict[str, Any]]:
    """The table of cracks, worst first; every crack of the report, those without a picture too."""
    anchors = {(c.crack.id, c.crack.polyline_px): c.anchor for page in pages for c in page.cards}
    rank = {severity: i for i, severity in enumerate((*palette.SEVERITIES, None))}
    ordered = sorted(cracks, key=lambda c: (rank[c.severity], -(c.width_max_mm or c.width_max_px), c.id))
    return [
        {
            "crack": c,
            "anchor": anchors.get((c.id, c.polyline_px)),
            "rank": rank[c.severity],
            **crack_numbers(c),
        }
        for c in ordered
    ]


def _map(report: CrackReport, seen: Sequence[Seen], structure: Structure | None) -> list[tuple[str, str]]:
    """(caption, picture) of the structure with its cracks, from above and where needed from below."""
    if structure is None or not structure.surfaces:
        return []
    scene = Scene(structure, cracks=report.cracks, colours=_inspected(seen))
    shown = [("From above", png_uri(picture(scene)))]
    if has_underside(scene):
        shown.append(("From below", png_uri(picture(scene, from_below=True))))
    return shown


def _inspected(seen: Sequence[Seen]) -> dict[str, str] | None:
    """The colour of inspected surfaces; None where there are none yet, and each has a colour of its own."""
    return {one.mosaic.surface.name: INSPECTED for one in seen if one.mosaic.surface is not None} or None


def _cloud_picture(
    model: RegisteredModel | None, cloud: tuple[npt.NDArray[np.float64], npt.NDArray[np.intp]] | None
) -> str | None:
    if model is None or cloud is None:
        return None
    places = [(s.T_world_scan[0][3], s.T_world_scan[1][3], s.T_world_scan[2][3]) for s in model.stations]
    return png_uri(cloud_picture(*cloud, [s.name for s in model.stations], places))


def _by_stage(left_out: Iterable[LeftOut]) -> list[tuple[str, list[LeftOut]]]:
    """In the order of the work, so that a cause stands before what follows from it."""

    def rank(one: LeftOut) -> tuple[int, str]:
        return (STAGES.index(one.stage) if one.stage in STAGES else len(STAGES), one.stage)

    return [(stage, list(items)) for (_, stage), items in groupby(sorted(left_out, key=rank), key=rank)]


def _settings(inspection: Inspection) -> list[tuple[str, list[tuple[str, str, bool]]]]:
    """Per group: name, value and whether it differs from the default."""
    groups = []
    for name in ("registration", "surfaces", "plan", "stitch", "patterns", "detect", "assess", "report"):
        group: Contract = getattr(inspection, name)
        default: Mapping[str, Any] = type(group)().model_dump(mode="json")
        values = group.model_dump(mode="json")
        groups.append((name, [(key, _shown(value), value != default[key]) for key, value in values.items()]))
    return groups


def _shown(value: Any) -> str:
    if value is None:
        return "automatic"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, list):
        return ", ".join(_shown(part) for part in value) or "none"
    return f"{value:g}" if isinstance(value, float) else str(value)


def _version() -> str:
    try:
        return importlib.metadata.version("hairline")
    except importlib.metadata.PackageNotFoundError:
        return "(not installed)"
