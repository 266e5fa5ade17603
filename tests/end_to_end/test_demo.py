"""The demos end to end: the wall from photos to report and score, and the bridge's chosen surfaces."""

import json
import re
from pathlib import Path

import numpy as np
import pytest

from tests.end_to_end.commands import hairline

WALL = ("demo", "--scene", "wall")


@pytest.mark.slow
def test_the_wall_from_photos_to_report_and_again_from_the_cache(tmp_path: Path) -> None:
    first = hairline(*WALL, cwd=tmp_path).stdout
    assert "cracks ≥ 3 px wide: 2 of 2 found" in first
    assert "false cracks: 0 on" in first
    report = tmp_path / "runs/demo-wall/report"
    cracks = json.loads((report / "cracks.json").read_text())["cracks"]
    assert len(cracks) == 2
    assert "<html" in (report / "index.html").read_text()
    again = hairline(*WALL, cwd=tmp_path).stdout
    assert re.findall(r"✓ (.+?)(?: ×\d+)?: (?!(?:\d+ )?cached$)", again, flags=re.MULTILINE) == []


@pytest.mark.usefixtures("own_store")
def test_the_surfaces_that_the_bridge_demo_names_are_those_with_the_cracks() -> None:
    from artifacts import store
    from schemas.settings import RegistrationSettings, SurfaceSettings
    from schemas.simulation import Truth
    from tasks.registration.task import register
    from tasks.simulation.task import demo_inspection, simulate_scans, simulation_truth
    from tasks.surfaces.task import extract

    inspection = demo_inspection("bridge")
    assert inspection.simulation is not None
    truth = Truth.model_validate_json(
        store.current().path(simulation_truth.bare(inspection.simulation)).read_bytes()
    )
    model = register.bare(simulate_scans.bare(inspection.simulation), RegistrationSettings())
    found = {surface.name: surface for surface in extract.bare(model, SurfaceSettings()).surfaces}
    matched = set()
    for name in inspection.plan.surfaces or ():
        surface = found[name]
        for true in truth.surfaces:
            middle = np.mean(true.to_world(true.outline_m), axis=0)
            aligned = np.dot(true.plane.normal, surface.plane.normal) > np.cos(np.radians(0.5))
            if aligned and abs(surface.plane.signed_distance_m(middle)) < 0.1:
                assert surface.area_m2 == pytest.approx(true.area_m2, rel=0.1)
                matched.add(true.name)
    assert matched == {true.name for true in truth.surfaces}
