"""Stages: the cracks' kind and severity, what was inspected and what was not; and the report of it all."""

import os
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any
from urllib.parse import quote

from artifacts import store
from artifacts.page import Page
from schemas.crack import Measurement
from schemas.crack_report import CrackReport
from schemas.detection import Detection, Patterns
from schemas.evaluation import Curves, Evaluation, Levels, Tally
from schemas.file import Folder
from schemas.flight_log import FlightLog
from schemas.flight_plan import FlightPlan
from schemas.inspection import Inspection
from schemas.mosaic import Mosaic
from schemas.problem import LeftOut
from schemas.registered_model import RegisteredModel
from schemas.settings import AssessSettings
from schemas.structure import Structure
from schemas.surface import Surface
from tasks.stage import stage

if TYPE_CHECKING:
    from tasks.assessment.curves import Probability
    from tasks.assessment.evaluation import Mask


def pages(inputs: Mapping[str, Any], result: CrackReport) -> list[Page]:
    rows = [
        {
            "surface": one.name,
            "inspected_m2": None if one.inspected_m2 is None else round(one.inspected_m2, 2),
            "area_m2": None if one.area_m2 is None else round(one.area_m2, 2),
            "photos": one.photos,
            "cracks": one.cracks,
        }
        for one in result.surfaces
    ]
    missing = [{"item": m.item, "what": m.what, "remedy": m.remedy} for m in result.not_inspected]
    shown = [Page(key="surfaces-inspected", table=rows)]
    return [*shown, Page(key="not-inspected", table=missing)] if missing else shown


@stage(pages=pages)
def assess(
    inspection: str,
    method: str,
    mosaics: tuple[Mosaic, ...],
    measurements: tuple[Measurement, ...],
    patterns: tuple[Patterns, ...],
    surfaces: tuple[Surface, ...],
    left_out: tuple[LeftOut, ...],
    settings: AssessSettings,
) -> CrackReport:
    """The report's content: cracks classified, surfaces with their areas, and what was not inspected."""
    from tasks.assessment.report import report as report_of

    return report_of(inspection, method, mosaics, measurements, patterns, surfaces, left_out, settings)


def tally(found: "Mask", truth: "Mask") -> Tally:
    """Agreement of a found and a drawn mask, (H, W) bool; no stage: only the command line asks for it."""
    from tasks.assessment.evaluation import tally as tally_masks

    return tally_masks(found, truth)


def evaluate(method: str, images: Sequence[Tally]) -> tuple[Evaluation, ...]:
    """A method's agreement over all images, at each tolerance."""
    from tasks.assessment.evaluation import evaluate as evaluate_tallies

    return evaluate_tallies(method, images)


def levels(probability: "Probability", truth: "Mask", tolerance_px: int) -> Levels:
    """What `curves` needs of one image; levels of several images add up."""
    from tasks.assessment.curves import levels as levels_of

    return levels_of(probability, truth, tolerance_px)


def curves(of_all: Levels, tolerance_px: int) -> Curves:
    """Precision, recall and calibration of a network's probabilities."""
    from tasks.assessment.curves import curves as curves_of

    return curves_of(of_all, tolerance_px)


def f1_of(one: Tally, tolerance_px: int) -> float:
    """Of one image."""
    from tasks.assessment.evaluation import TOLERANCES_PX, scores

    return scores(one.areas[TOLERANCES_PX.index(tolerance_px)]).f1


def near(mask: "Mask", radius_px: int) -> "Mask":
    """(H, W) pixels within `radius_px` of the mask."""
    from tasks.assessment.evaluation import near as near_mask

    return near_mask(mask, radius_px)


def link(inputs: Mapping[str, Any], _folder: Folder) -> list[Page]:
    host = os.environ.get("HAIRLINE_REPORT_URL", "http://127.0.0.1:4201")
    name = inputs["inspection"].name
    return [
        Page(key="report", description=f"Report of {name}", link=f"{host}/{quote(name)}/report/index.html")
    ]


@stage(pages=link)
def write_report(
    inspection: Inspection,
    report: CrackReport,
    mosaics: tuple[Mosaic, ...],
    measurements: tuple[Measurement, ...],
    patterns: tuple[Patterns, ...],
    detections: tuple[Detection, ...],
    structure: Structure | None,
    model: RegisteredModel | None,
    plan: FlightPlan | None,
    log: FlightLog | None,
) -> Folder:
    """index.html for people, cracks.csv and cracks.json for other programs."""
    from artifacts.report import write_report as write_pages

    files = store.current()
    with files.scratch() as folder:
        write_pages(
            folder,
            inspection=inspection,
            report=report,
            mosaics=mosaics,
            measurements=measurements,
            patterns=patterns,
            detections=detections,
            structure=structure,
            model=model,
            plan=plan,
            log=log,
            open_file=files.path,
        )
        return files.put_folder(folder)
