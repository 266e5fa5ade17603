"""Rows of `make bench-scans` on a structure that repeats itself: where nothing else tells its parts apart, a
scan must be refused."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from schemas.problem import BadInput
from schemas.scanning import Scanning
from tasks.simulation import bridge
from tasks.simulation.face import Placement
from tasks.simulation.scene import Scene
from tests.benchmarks.surveys import Survey, pose_errors, registered, survey
from tests.benchmarks.table import Row, row

PLACE = Placement(yaw_deg=17.0)
PIERS, APART_M = 11, 12.0
ALONG_M = (-18.0, 0.0, 18.0)  # of the stations, each up to 2 m off
SEEDS = range(1, 6)
STEP_DEG = 0.3
RIGHT_MM = 300.0


def equal_piers(seed: int) -> Scene:
    """A viaduct of equal piers on a plain, and three stations 15 m beside it."""
    x, y, _ = np.eye(3)
    faces = [PLACE.face("ground", (-150.0, -150.0, 0.0), x, y, 300.0, 300.0, "ground")]
    for k in range(PIERS):
        at = (k - (PIERS - 1) / 2) * APART_M
        faces += PLACE.box(f"pier{k}", (at - 0.6, -2.0, 0.0), (at + 0.6, 2.0, 9.0), "wesn")
    half = PIERS * APART_M / 2
    faces += PLACE.box("deck", (-half, -3.0, 9.0), (half, 3.0, 9.8), "wesntb")
    rng = np.random.default_rng([seed, 7])
    stations = [
        (at + rng.uniform(-2, 2), -15.0 + rng.uniform(-3, 3), 1.6 + rng.uniform(-0.1, 0.1)) for at in ALONG_M
    ]
    return replace(
        bridge.bridge(seed), faces=tuple(faces), stations_m=tuple(PLACE.point(place) for place in stations)
    )


def rows() -> Iterator[Row]:
    astray, tied, lost, worst_mm = 0, 0, 0, []
    for seed in SEEDS:
        with TemporaryDirectory() as name:
            case = survey(equal_piers(seed), Scanning(step_deg=STEP_DEG), Path(name))
            blind = _station_errors_mm(case.without_positions())
            stated = _station_errors_mm(case)
        astray += sum(error_mm > RIGHT_MM for error_mm in blind)
        tied += len(blind)
        lost += len(case.given) - len(stated)
        worst_mm.append(max(stated, default=np.inf))
    data = f"simulated viaduct of {PIERS} equal piers, 3 stations, {STEP_DEG}° steps"
    known = {"data": data, "seed": f"{len(SEEDS)} seeds"}
    of = f"of {len(SEEDS) * len(ALONG_M)}"
    yield row("equal piers, no poses: stations tied in a wrong place", astray, of, "≤ 0", **known)
    yield row("equal piers, no poses: stations tied", tied, of, None, **known)
    yield row("equal piers, positions to 5 cm: stations lost", lost, of, "≤ 0", **known)
    yield row("equal piers, positions to 5 cm: worst station", max(worst_mm), "mm", "≤ 2", **known)


def _station_errors_mm(case: Survey) -> list[float]:
    """Of the stations that were tied."""
    try:
        _, T, _ = registered(case)
    except BadInput:
        return []
    return list(pose_errors(T, case).station_mm.values())
