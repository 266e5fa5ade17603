"""The inspection's result: every crack, every surface, and what was not inspected."""

from schemas.crack import Crack, Measurement
from schemas.crack_report import CrackReport, SurfaceInspected
from schemas.detection import Patterns
from schemas.mosaic import Mosaic
from schemas.problem import LeftOut
from schemas.settings import AssessSettings
from schemas.surface import Surface
from tasks.assessment.classify import classified

STAGE = "assessment"
UNSEEN_SHARE = 0.02  # of a surface's area: less than this is the rim of its outline
HIDDEN_SHARE = 0.0005  # of a mosaic under markers: less is stray pixels


def report(
    inspection: str,
    method: str,
    mosaics: tuple[Mosaic, ...],
    measurements: tuple[Measurement, ...],
    patterns: tuple[Patterns, ...],
    surfaces: tuple[Surface, ...],
    left_out: tuple[LeftOut, ...],
    settings: AssessSettings,
) -> CrackReport:
    """mosaics, measurements and patterns go together, one each; surfaces are all that were to be seen."""
    inspected: list[SurfaceInspected] = []
    cracks: list[Crack] = []
    missing = list(left_out)
    for mosaic, measurement, pattern in zip(mosaics, measurements, patterns, strict=True):
        of_surface = classified(measurement.cracks, mosaic.surface, settings)
        cracks += of_surface
        one = _inspected(mosaic, pattern, len(of_surface), method)
        inspected.append(one)
        missing += _parts_missing(one, mosaic, pattern)
    seen = {mosaic.surface.name for mosaic in mosaics if mosaic.surface is not None}
    named = {problem.item for problem in missing}
    missing += [
        LeftOut(
            item=surface.name, stage=STAGE, what="no photo of it is in any mosaic", remedy="Photograph it"
        )
        for surface in surfaces
        if surface.name not in seen | named
    ]
    return CrackReport(
        inspection=inspection,
        method=method,
        surfaces=tuple(inspected),
        cracks=tuple(cracks),
        not_inspected=tuple(dict.fromkeys(missing)),
    )


def _inspected(mosaic: Mosaic, pattern: Patterns, cracks: int, method: str) -> SurfaceInspected:
    return SurfaceInspected(
        name=mosaic.name,
        area_m2=None if mosaic.surface is None else mosaic.surface.area_m2,
        inspected_m2=_area_m2(pattern.inspectable_px, mosaic),
        gsd_mm_px=mosaic.gsd_mm_px,
        photos=sum(placement.status != "rejected" for placement in mosaic.placements),
        cracks=cracks,
        method=method,
    )


def _parts_missing(one: SurfaceInspected, mosaic: Mosaic, pattern: Patterns) -> list[LeftOut]:
    """What of a mosaic's surface was not looked at, in words."""
    missing = []
    if one.area_m2 and one.inspected_m2 is not None:
        hidden_m2 = _area_m2(pattern.pattern_px, mosaic) or 0.0
        unseen_m2 = one.area_m2 - one.inspected_m2 - hidden_m2
        if unseen_m2 > UNSEEN_SHARE * one.area_m2:
            what = f"{unseen_m2:.2f} of {one.area_m2:.2f} m² are on no photo"
            missing.append(LeftOut(item=mosaic.name, stage=STAGE, what=what, remedy="Photograph it again"))
    if pattern.pattern_px > HIDDEN_SHARE * mosaic.width_px * mosaic.height_px:
        area_m2 = _area_m2(pattern.pattern_px, mosaic)
        size = f"{pattern.pattern_px} px" if area_m2 is None else f"{area_m2:.3f} m²"
        what = f"{size} are hidden by markers or other patches of a strong colour"
        missing.append(LeftOut(item=mosaic.name, stage=STAGE, what=what, remedy="Look at them by eye"))
    return missing


def _area_m2(pixels: int, mosaic: Mosaic) -> float | None:
    return None if mosaic.gsd_mm_px is None else pixels * (mosaic.gsd_mm_px / 1000.0) ** 2
