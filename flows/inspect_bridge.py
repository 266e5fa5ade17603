"""From raw scans and photos to a crack report: the whole of the paper, and the report it leaves to do."""

from collections.abc import Sequence
from pathlib import Path

from flows.collect_images import Collected, collect
from flows.detect_cracks import Detected, detect_in_photos
from flows.external_flight import given_logs
from flows.inspection_flow import inspection_flow
from flows.model_structure import Modelled, has_scans, model
from flows.opening import OpenRun, opened
from schemas.crack_report import CrackReport
from schemas.inspection import PhotoSet
from schemas.problem import BadInput
from schemas.surface import Surface
from tasks.assessment.task import assess, write_report


@inspection_flow("inspect-bridge", __doc__)
def inspect_bridge(
    inspection: str = "demo:bridge",
    out: str | None = None,
    redo: tuple[str, ...] = (),
    photos: str | None = None,
    logs: tuple[str, ...] = (),
) -> CrackReport | None:
    """inspection: path of the YAML file (or demo:bridge, demo:wall); out: the run's folder; redo: stages to
    run again; photos, logs: of an external flight. Without photos it ends with the plan, and gives None."""
    with opened(inspection, out, redo) as run:
        if photos is not None or logs:
            run = with_flight(run, photos, logs)
        return inspect(run)


def inspect(run: OpenRun) -> CrackReport | None:
    """The paper's two stages, data collection and crack detection, and the report."""
    given_logs(run.inspection, run.base)  # one that cannot be read is told before hours of work
    modelled = model(run.inspection, run.base) if has_scans(run.inspection) else None
    if modelled is not None:
        run.save_model(modelled)
    structure = modelled.structure if modelled else None
    collected = collect(run.inspection, run.base, structure, run.save_plan)
    run.save_collected(collected)
    if collected.photos:
        photos, surfaces = collected.photos, collected.surfaces
        detected = detect_in_photos(run.inspection, run.base, photos, surfaces, modelled)
        run.save_detected(detected)
        return report(run, modelled, collected, detected)
    if modelled is None:
        raise BadInput(
            run.inspection.name, "names neither scans nor photos", "Give 'scans', 'photos' or 'simulation'"
        )
    return None


def report(run: OpenRun, modelled: Modelled | None, collected: Collected, detected: Detected) -> CrackReport:
    """Judge what was measured, list what was not inspected, and write it down for an engineer."""
    mosaics = tuple(one.mosaic for one in detected.inspected)
    measurements = tuple(one.measurement for one in detected.inspected)
    patterns = tuple(one.patterns for one in detected.inspected)
    left_out = (*(modelled.left_out if modelled else ()), *collected.left_out, *detected.left_out)
    assessed = assess(
        run.inspection.name,
        run.inspection.detect.method,
        mosaics,
        measurements,
        patterns,
        _meant_to_be_inspected(collected),
        left_out,
        run.inspection.assess,
    )
    pages = write_report(
        run.inspection,
        assessed,
        mosaics,
        measurements,
        patterns,
        tuple(one.detection for one in detected.inspected),
        modelled.structure if modelled else None,
        modelled.model if modelled else None,
        collected.plan,
        collected.log,
    )
    run.save_report(assessed, pages)
    return assessed


def _meant_to_be_inspected(collected: Collected) -> tuple[Surface, ...]:
    """Those of the plan; without a plan, those that photos were brought of."""
    if collected.plan is not None:
        names = {of_surface.surface for of_surface in collected.plan.coverage}
    else:
        names = {photo.surface for photo in collected.photos}
    return tuple(surface for surface in collected.surfaces if surface.name in names)


def with_flight(run: OpenRun, photos: str | None, logs: Sequence[str]) -> OpenRun:
    """The run of an external flight that is now flown: its photos and logs, as paths from here."""
    update: dict[str, object] = {}
    if photos is not None:
        update["photos"] = (PhotoSet(folder=_from_here("--photos", photos)),)
    if logs:
        update["flight_log"] = tuple(_from_here("--log", log) for log in logs)
    return OpenRun(run.inspection.model_copy(update=update), run.base, run.folder)


def _from_here(option: str, path: str) -> str:
    resolved = Path(path).resolve()
    if not resolved.exists():
        raise BadInput(f"{option} {path}", "no such file or folder", "Correct the path")
    return str(resolved)
