from pathlib import Path

import numpy as np
import pytest

from artifacts.store import Store
from schemas.crack_report import CrackReport
from schemas.problem import LeftOut
from schemas.settings import AssessSettings, DetectSettings, PatternSettings
from tasks.assessment import task as assessment
from tasks.detection.task import detect
from tasks.measurement.task import measure
from tasks.patterns.task import remove_patterns
from tests.measurement.drawn_crack import drawn_crack
from tests.measurement.mosaics import mosaic_of, wall

GSD_MM_PX = 1.0


def reported(own_store: Path, height_m: float, left_out: tuple[LeftOut, ...] = ()) -> CrackReport:
    rgb = drawn_crack(lambda x: 0 * x + 4.0).rgb
    rgb[20:50, 40:70] = (235, 60, 170)
    surface = wall(0.48, height_m)
    mosaic = mosaic_of(Store(own_store), rgb, GSD_MM_PX, surface)
    settings = DetectSettings(method="ridge")
    patterns = remove_patterns.bare(mosaic, PatternSettings())
    measured = measure.bare(mosaic, patterns, detect.bare(mosaic, patterns, settings), settings)
    other = surface.model_copy(update={"name": "pier"})
    return assessment.assess.bare(
        "bridge",
        "hairline",
        (mosaic,),
        (measured,),
        (patterns,),
        (surface, other),
        left_out,
        AssessSettings(),
    )


def test_areas_and_what_was_not_inspected(own_store: Path) -> None:
    result = reported(own_store, height_m=0.20)  # photographed: 0.16 m of it
    one = result.surfaces[0]
    marker_m2 = 36 * 36 * 1e-6
    assert (one.name, one.photos, one.cracks, one.method) == ("wall", 1, 1, "hairline")
    assert one.inspected_m2 == pytest.approx(0.48 * 0.16 - marker_m2, abs=2e-4)
    missing = {(left.item, left.what.split(" ", 1)[1]) for left in result.not_inspected}
    assert ("pier", "photo of it is in any mosaic") in missing
    assert any(item == "wall" and "are on no photo" in what for item, what in missing)
    assert any(item == "wall" and "hidden by markers" in what for item, what in missing)
    assert result.cracks[0].kind == "longitudinal" and result.cracks[0].severity == "wide"
    assert assessment.assess.pages is not None and len(assessment.assess.pages({}, result)) == 2


def test_what_is_known_to_be_left_out_is_said_once(own_store: Path) -> None:
    known = LeftOut(item="pier", stage="photos", what="its photos are truncated")
    result = reported(own_store, 0.16, (known, known))
    assert [left for left in result.not_inspected if left.item == "pier"] == [known]
    assert not any("on no photo" in left.what for left in result.not_inspected)
    assert np.isfinite([crack.width_max_mm or 0.0 for crack in result.cracks]).all()
