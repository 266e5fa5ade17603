"""Photos become mosaics, markers are taken out, cracks are found and measured (paper, section 3)."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path
from typing import Any, TypeVar

from artifacts import store
from flows.collect_images import collect
from flows.given_photos import PhotoSource
from flows.inspection_file import existing
from flows.inspection_flow import inspection_flow
from flows.model_structure import Modelled, has_scans, model
from flows.opening import opened
from schemas.crack import Measurement
from schemas.detection import Detection, Patterns
from schemas.inspection import Inspection
from schemas.mosaic import Mosaic
from schemas.photo import Photo
from schemas.problem import BadInput, LeftOut
from schemas.surface import Surface
from tasks.detection.task import detect
from tasks.measurement.task import measure
from tasks.patterns.task import remove_patterns
from tasks.photos.task import features, fit_alone, ingest
from tasks.stitching.task import single, stitch
from tasks.surfaces.task import measure_relief

T = TypeVar("T")


@dataclass(frozen=True)
class Inspected:
    """One surface, or one photo that stands for itself, seen through to its cracks."""

    mosaic: Mosaic
    patterns: Patterns
    detection: Detection
    measurement: Measurement


@dataclass(frozen=True)
class Detected:
    inspected: tuple[Inspected, ...]
    problems: tuple[LeftOut, ...]

    @property
    def left_out(self) -> tuple[LeftOut, ...]:
        of_mosaics = (left for one in self.inspected for left in one.mosaic.left_out)
        return (*self.problems, *of_mosaics)


def detect_in_photos(
    inspection: Inspection,
    base: Path,
    sources: tuple[PhotoSource, ...],
    surfaces: tuple[Surface, ...],
    modelled: Modelled | None,
) -> Detected:
    """Stitch each surface's photos, take the markers out, find the cracks and measure them."""
    problems: list[LeftOut] = []

    def usable(stage: str, members: list[T], outcomes: Sequence[object]) -> list[tuple[Any, ...]]:
        """Each member with its outcome; what failed becomes a problem that the report lists."""
        bad = [one for one in outcomes if isinstance(one, BadInput)]
        problems.extend(LeftOut.because(stage, one) for one in bad)
        good = [(m, o) for m, o in zip(members, outcomes, strict=True) if not isinstance(o, BadInput)]
        if not good:
            raise bad[0] if bad else BadInput("photos", "none given", "List their folders under 'photos'")
        return good

    taken = ingest.each(
        (s.file, s.name, s.surface, s.camera, s.pose, s.position_sigma_m, s.velocity_m_s) for s in sources
    )
    read = usable("photos", list(sources), taken)
    photos = [(source, photo) for (source, _), photo in usable("photos", read, _inspectable(read))]
    problems.extend(_control_of_nothing(inspection, {s.surface for s, _ in photos if s.stitch}))
    mosaics = _mosaics(inspection, photos, surfaces, modelled)
    mosaics = [m for _, m in usable("stitching", [None] * len(mosaics), mosaics)]
    cleaned = usable("patterns", mosaics, remove_patterns.each((m, inspection.patterns) for m in mosaics))
    settings = inspection.detect
    if inspection.report.baselines:
        settings = settings.model_copy(update={"baselines": True})
    network = store.current().put(existing(base, settings.model, "detect.model")) if settings.model else None
    found = usable("detection", cleaned, detect.each((m, p, settings, network) for m, p in cleaned))
    measured = usable("measurement", found, measure.each((m, p, d, inspection.detect) for (m, p), d in found))
    return Detected(tuple(Inspected(m, p, d, cracks) for ((m, p), d), cracks in measured), tuple(problems))


def _inspectable(photos: Sequence[tuple[PhotoSource, Photo]]) -> list[Photo | BadInput]:
    """Those that stand for themselves are judged here; `stitch` judges those of a surface by each other."""
    alone = iter(fit_alone([photo for source, photo in photos if not source.stitch]))
    return [photo if source.stitch else next(alone) for source, photo in photos]


def _control_of_nothing(inspection: Inspection, names: set[str]) -> list[LeftOut]:
    """Control that names no mosaic."""
    return [
        LeftOut(
            item=f"control of {name}",
            stage="stitching",
            what="no photos are stitched to a mosaic of this name",
            remedy=f"The names are: {', '.join(sorted(names)) or 'none'}",
        )
        for name in sorted(set(inspection.control) - names)
    ]


def _mosaics(
    inspection: Inspection,
    photos: list[tuple[PhotoSource, Photo]],
    surfaces: tuple[Surface, ...],
    modelled: Modelled | None,
) -> list[Mosaic | BadInput]:
    """A mosaic for each surface, and one for each photo that stands for itself."""
    known = {surface.name: surface for surface in surfaces}
    alone = single.each((photo, source.gsd_mm_px) for source, photo in photos if not source.stitch)
    to_stitch = sorted(((s, p) for s, p in photos if s.stitch), key=lambda pair: pair[0].surface)
    described = features.each((photo, inspection.stitch) for _, photo in to_stitch)
    scanned = {s.name for s in modelled.structure.surfaces} if modelled else set()
    shown = {source.surface for source, _ in to_stitch} & scanned & known.keys()
    seen = tuple(known[name] for name in sorted(shown))
    reliefs = measure_relief(modelled.model, seen) if modelled and seen else ()
    of_surface = {relief.surface: relief for relief in reliefs}
    calls = []
    for name, group in groupby(zip(to_stitch, described, strict=True), key=lambda m: m[0][0].surface):
        members = [(source, photo, f) for (source, photo), f in group if not isinstance(f, BadInput)]
        gsd_mm_px = inspection.stitch.gsd_mm_px or members[0][0].gsd_mm_px
        settings = inspection.stitch.model_copy(update={"gsd_mm_px": gsd_mm_px})
        of_photos, of_features = tuple(p for _, p, _ in members), tuple(f for *_, f in members)
        control = inspection.control.get(name)
        surface, relief = known.get(name), of_surface.get(name)
        calls.append((name, surface, of_photos, of_features, settings, control, relief))
    return [*alone, *stitch.each(calls)]


@inspection_flow("detect-cracks", __doc__)
def detect_cracks(inspection: str = "demo:wall", out: str | None = None) -> None:
    """inspection: path of the YAML file (or demo:wall); out: the run's folder."""
    with opened(inspection, out) as run:
        modelled = model(run.inspection, run.base) if has_scans(run.inspection) else None
        structure = modelled.structure if modelled else None
        collected = collect(run.inspection, run.base, structure, run.save_plan)
        sources, surfaces = collected.photos, collected.surfaces
        run.save_detected(detect_in_photos(run.inspection, run.base, sources, surfaces, modelled))
