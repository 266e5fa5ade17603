"""Rows of `make bench-scans` on surfaces and obstacles: against truth and other programs.

Each seed has its own noise, trees, and stations moved by half a metre. What is scored is in surface_score.py,
the peers are in surface_peers.py.
"""

import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from schemas.scanning import Scanning
from schemas.surface import Surface
from tasks.simulation.face import vector
from tasks.simulation.scan_faults import every_fault
from tasks.simulation.scene import Scene
from tasks.simulation.scenes import SCENES
from tasks.surfaces.cloud import Cloud
from tasks.surfaces.extraction import Extraction, extract_structure
from tasks.surfaces.naming import middle_m
from tests.benchmarks.merged_scans import MergedScans, merged_scans
from tests.benchmarks.surface_peers import PEERS, SETTINGS, own_search_s
from tests.benchmarks.surface_score import Truth, obstacles_found, score_surfaces
from tests.benchmarks.table import Row, row

Floats = npt.NDArray[np.float64]
SEEDS, NAME_SEEDS = range(1, 6), range(1, 11)
PEER_SEEDS = range(1, 2)  # segment_plane takes minutes
MOVED_M = 0.5
THINGS = {
    "bridge": ("lamp", "car", "rail", "trunk", "leaf"),
    "arch": ("bench", "bollard", "sign", "rail", "trunk", "leaf"),
    "facade": ("car0", "car1", "lamp0", "lamp1", "bin", "bench", "cable", "trunk", "leaf"),
}
CABLES = {"arch": "rail-cable", "facade": "cable"}
FEWEST_ON_CABLE, LARGE_M = 50, 0.3
BARS = {"bridge": 0.90, "arch": 0.85, "facade": 0.85}


@dataclass(frozen=True)
class Case:
    scene: Scene
    truth: Truth
    scans: MergedScans


def site(name: str, seed: int, moved_m: float = MOVED_M) -> Scene:
    """The scene with its stations moved by up to `moved_m`, otherwise for each seed."""
    scene = SCENES[name](seed)
    rng = np.random.default_rng([seed, 0x53697465])
    off = rng.uniform(-moved_m, moved_m, (len(scene.stations_m), 3)) * (1, 1, 0.2)
    return replace(scene, stations_m=tuple(vector(p) for p in np.asarray(scene.stations_m) + off))


def _case(name: str, seed: int, scanning: Scanning) -> Case:
    scene = site(name, seed)
    return Case(scene, Truth.of(scene, scanning.step_deg), merged_scans(scene, scanning))


def _extracted(cloud: Cloud) -> tuple[Extraction, float]:
    began = time.process_time()
    return extract_structure(cloud, SETTINGS, "benchmark", lambda f: None), time.process_time() - began


def _row(what: str, values: Sequence[float], unit: str, bar: str | None, data: str, **peer: Any) -> Row:
    """The median over the seeds."""
    return row(what, float(np.median(values)), unit, bar, data, f"{len(values)} seeds", **peer)


def structure(name: str) -> Iterator[Row]:
    recall, precision, normal, offset, seconds, coverage, deviation = ([] for _ in range(7))
    large, on_cables, kept_cables = 0, 0, 0
    found_large = 0
    peers: dict[str, list[tuple[float, float, float, float]]] = {peer: [] for peer in PEERS}
    for seed in SEEDS:
        case = _case(name, seed, Scanning())
        extraction, cpu = _extracted(case.scans.cloud)
        score = score_surfaces(extraction.surfaces, case.truth)
        recall.append(score.recall)
        precision.append(score.precision)
        normal.append(float(np.quantile(score.normal_deg, 0.95)))
        offset.append(float(np.quantile(score.offset_m, 0.95)) * 1000)
        seconds.append(cpu)
        if len(score.coverage):
            coverage.append(float(score.coverage.min()))
            deviation.append(score.deviation_m * 1000)
        points = case.scans.cloud.points
        things = _things(case.scene, THINGS[name], case.scans, smallest_m=LARGE_M)
        found = obstacles_found(extraction.obstacles, extraction.surfaces, points, things)
        large, found_large = large + len(found), found_large + sum(found)
        if name in CABLES:
            cable = _things(case.scene, (CABLES[name],), case.scans, smallest_m=0.0)
            cable = [own for own in cable if len(own) >= FEWEST_ON_CABLE]
            kept = obstacles_found(extraction.obstacles, (), points, cable)
            on_cables, kept_cables = on_cables + len(kept), kept_cables + sum(kept)
        if seed in PEER_SEEDS:
            cpu, search_s = _extracted(case.scans.cloud)[1], own_search_s(case.scans.cloud)  # compiled by now
            for peer, planes in PEERS.items():
                found_by_peer, peer_cpu = planes(case.scans.cloud)
                peer_score = score_surfaces(found_by_peer, case.truth)
                score_of = (peer_score.recall, peer_score.precision)
                peers[peer].append((*score_of, search_s / peer_cpu, cpu / peer_cpu))
    data = f"simulated {name}, scanned from {len(case.scene.stations_m)} stations"
    for peer, scores in peers.items():
        theirs = np.median(np.array(scores), axis=0)
        bar = f"≥ {BARS[name]}"
        yield _row(
            f"{name}: recall of surfaces", recall, "1", bar, data, peer=peer, peer_value=round(theirs[0], 3)
        )
        yield _row(
            f"{name}: precision of surfaces",
            precision,
            "1",
            bar,
            data,
            peer=peer,
            peer_value=round(theirs[1], 3),
        )
        eighth = "≤ 0.125" if name == "bridge" and peer == "Open3D segment_plane" else None
        for column, what, limit in (
            (2, "CPU time of the search for planes", eighth),
            (3, "CPU time with noise filter, outlines, names and obstacles", None),
        ):
            ratios = [of_seed[column] for of_seed in scores]
            text = f"{name}: {what}, to the peer's search"
            yield _row(text, ratios, "1", limit, data, peer=peer, peer_value=1.0)
    limits = ("≤ 0.1", "≤ 3") if name == "bridge" else (None, None)
    yield _row(f"{name}: normals, 95th percentile", normal, "°", limits[0], data)
    yield _row(f"{name}: offsets, 95th percentile", offset, "mm", limits[1], data)
    yield _row(f"{name}: CPU time", seconds, "s", None, data)
    if coverage:
        yield _row(f"{name}: least covered curved part", coverage, "1", "≥ 0.85", data)
        limit = 1000 * SETTINGS.distance_m
        yield _row(f"{name}: strips' deviation from the curve, 95 %", deviation, "mm", f"≤ {limit:g}", data)
    yield _row(
        f"{name}: obstacles ≥ {LARGE_M} m found", [found_large / large], "1", "≥ 1", f"{data}; {large} things"
    )
    if on_cables:
        yield _row(
            f"{name}: 20 mm cables kept", [kept_cables / on_cables], "1", "≥ 1", f"{data}; {on_cables} cables"
        )


def faults(name: str) -> Iterator[Row]:
    scores = []
    for seed in SEEDS:
        case = _case(name, seed, every_fault(seed))
        scores.append(score_surfaces(_extracted(case.scans.cloud)[0].surfaces, case.truth))
    bar, data = f"≥ {BARS[name]}", f"simulated {name}, every fault of the scanner on"
    yield _row(f"{name}, faults: recall of surfaces", [s.recall for s in scores], "1", bar, data)
    yield _row(f"{name}, faults: precision of surfaces", [s.precision for s in scores], "1", bar, data)


def growth() -> Iterator[Row]:
    """CPU time over points: as the site grows (bridges in a row), and as it is scanned more finely."""
    bridge = merged_scans(site("bridge", 1), Scanning(step_deg=0.72)).cloud
    side_m = float(np.ptp(bridge.points[:, 0])) + 5.0
    in_a_row = []
    for count in (1, 2, 4, 8):
        moved = [bridge.points + np.array([k * side_m, 0.0, 0.0]) for k in range(count)]
        parts = [
            np.concatenate(moved),
            np.tile(bridge.normals, (count, 1)),
            np.tile(bridge.views, (count, 1)),
        ]
        in_a_row.append(Cloud(*parts))
    finer = [merged_scans(site("bridge", 1), Scanning(step_deg=s)).cloud for s in (1.0, 0.7, 0.5, 0.35)]
    for what, clouds in (("a larger site", in_a_row), ("a denser scan", finer)):
        _extracted(clouds[0])  # compiled once
        sizes, seconds = [len(c) for c in clouds], [_extracted(c)[1] for c in clouds]
        exponent = float(np.polyfit(np.log(sizes), np.log(seconds), 1)[0])
        data = "simulated bridge, " + ", ".join(f"{n / 1000:.0f}k" for n in sizes) + " points"
        yield _row(f"surfaces: CPU time's exponent in points, {what}", [exponent], "1", "≤ 1.15", data) | {
            "seed": 1
        }


def names() -> Iterator[Row]:
    """How many surfaces bear the same name in other scans of the bridge."""
    runs = [
        _extracted(merged_scans(site("bridge", seed, 0.0), Scanning()).cloud)[0].surfaces
        for seed in NAME_SEEDS
    ]
    for what, least_m2 in (("surfaces of 2 m² and more", 2.0), ("all surfaces", 0.0)):
        same = [_same_names(runs[0], other, least_m2) for other in runs[1:]]
        bar = "≥ 1" if least_m2 else None
        yield _row(
            f"bridge: names kept in another scan, {what}", same, "1", bar, f"{len(runs)} scans of the bridge"
        )


def _same_names(one: Sequence[Surface], other: Sequence[Surface], least_m2: float) -> float:
    """Of surfaces within half a metre and 8° of each other in two runs, the share that are called alike."""
    middles = np.array([middle_m(s) for s in other])
    normals = np.array([s.plane.normal for s in other])
    kept = []
    for surface in one:
        if surface.name.startswith("ground") or surface.area_m2 < least_m2:
            continue
        away = np.linalg.norm(middles - middle_m(surface), axis=1)
        away[normals @ np.asarray(surface.plane.normal) < np.cos(np.radians(8))] = np.inf
        if away.min() < 0.5:
            kept.append(other[int(away.argmin())].name == surface.name)
    return float(np.mean(kept))


def _things(
    scene: Scene, prefixes: Sequence[str], scans: MergedScans, smallest_m: float
) -> list[npt.NDArray[np.int64]]:
    """Indices of the points of each thing that was scanned at all and is large enough; a tree's leaves are
    one thing, a row of rail posts several."""
    groups: dict[str, list[int]] = {}
    for number, face in enumerate(scene.faces):
        prefix = next((p for p in prefixes if face.name.startswith(p)), None)
        if prefix is not None:
            single = prefix == "rail"
            groups.setdefault(face.name.rpartition("-")[0] if single else prefix, []).append(number)
    found = []
    for numbers in groups.values():
        own = np.flatnonzero(np.isin(scans.face, numbers))
        if len(own) >= 10 and np.ptp(scans.cloud.points[own], axis=0).max() >= smallest_m:
            found.append(own)
    return found
