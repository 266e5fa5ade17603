"""Rows of `make bench-scans` on size: how time grows, and the largest survey a crew brings."""

import resource
from collections.abc import Iterator, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from schemas.scanning import Scanning
from tests.benchmarks.registration_rows import COARSE_STEP_DEG, SEEDS, STEP_DEG, surveys
from tests.benchmarks.surveys import Survey, pose_errors, registered, survey, viaduct
from tests.benchmarks.table import Row, row

GROWTH_STEPS_DEG = (0.6, 0.42, 0.3, 0.21)
LOOKS = 50  # so that a scan has some 20 million points


def growth() -> Iterator[Row]:
    """Exponents of CPU time, by the slope of a line through logarithms."""
    points, seconds = [], []
    for step_deg in GROWTH_STEPS_DEG:
        for _, case in surveys("points", step_deg, SEEDS[:1]):
            found, _, cpu_s = registered(case)
        points.append(sum(s.points for s in found.stations))
        seconds.append(cpu_s)
    data = f"simulated bridge, 9 stations, {points[0]:,} to {points[-1]:,} points"
    yield row("growth of CPU time with points", _slope(points, seconds), "exponent", "≤ 1.15", data, "1")
    pairs, seconds = [], []
    for _, case in surveys("stations", COARSE_STEP_DEG, SEEDS[:1]):
        for stations in (4, 6, 7, 9):
            found, _, cpu_s = registered(Survey(case.given[:stations], case.T_world_scan, case.checks_m))
            pairs.append(len(found.pairs))
            seconds.append(cpu_s)
    data = f"simulated bridge, {pairs[0]} to {pairs[-1]} overlapping pairs"
    yield row("growth of CPU time with pairs", _slope(pairs, seconds), "exponent", "≤ 1.15", data, "1")


def fifty_stations() -> Iterator[Row]:
    """As many points as a crew brings at most: run alone, since the memory is the process's."""
    with TemporaryDirectory() as name:
        scanning = Scanning(step_deg=STEP_DEG)
        case = survey(viaduct(1, 50), scanning, Path(name), looks=LOOKS)
        found, T, cpu_s = registered(case)
        errors = pose_errors(T, case)
    points = sum(s.points for s in found.stations)
    known: dict[str, Any] = {
        "data": f"simulated viaduct, {len(case.given)} stations, {points / 1e6:.0f} million points",
        "seed": "1",
    }
    gib = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
    yield row("fifty stations: peak memory", gib, "GiB", "≤ 8", **known)
    yield row("fifty stations: stations lost", len(found.left_out), "stations", "≤ 0", **known)
    yield row("fifty stations: check points", errors.check_mm, "mm RMSE", "≤ 2", **known)
    yield row("fifty stations: worst station", max(errors.station_mm.values()), "mm", "≤ 2", **known)
    yield row("fifty stations: CPU time", cpu_s, "s", None, **known)


def _slope(sizes: Sequence[float], seconds: Sequence[float]) -> float:
    return float(np.polyfit(np.log(sizes), np.log(seconds), 1)[0])


PARTS = {
    "growth": growth,
    "fifty-stations": fifty_stations,
}
