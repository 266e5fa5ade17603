"""Rows of `make bench-scans` on registration: against the simulator's truth and beside other programs.

Each seed is a bridge of its own noise, trees and positions, scanned from nine stations (about 400,000 points
each). Peers and settings are in registration_peers.py. A time is CPU seconds on one core.
"""

from collections.abc import Iterator, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from schemas.scanning import Scanning
from schemas.target import SeenTarget, SiteTarget
from tasks.registration.cloud_shelf import Shelf
from tasks.registration.load_stations import load_stations
from tasks.registration.placement import place
from tasks.registration.pose_graph import Edge, optimise, spanning_start
from tasks.registration.read_scan import read_scan
from tasks.registration.register import Registration
from tasks.registration.rigid_motion import Array, angle_deg, exp, inverse, transform, yaw
from tasks.registration.station_site import shape
from tasks.simulation import arch, bridge, scan_faults
from tests.benchmarks.registration_peers import (
    BLIND,
    FINE,
    PLAIN,
    Gicp,
    edges_of,
)
from tests.benchmarks.surveys import (
    SETTINGS,
    PoseErrors,
    Survey,
    nine_station_bridge,
    pose_errors,
    registered,
    survey,
)
from tests.benchmarks.table import Row, row

SEEDS = range(1, 6)
REFUSAL_SEEDS = range(1, 11)
STEP_DEG = 0.25  # about 400,000 points a scan
COARSE_STEP_DEG = 0.6  # where only yes or no is asked
RIGHT_DEG, RIGHT_M = 1.0, 0.3
EVERY = 4  # one pair of so many is placed blindly by peers too
TARGETS = 8
TARGET_SIGMA_M = 0.001  # of a target's centre in a scan
IN_99 = 16.81  # of χ² with six degrees of freedom


def known_positions() -> Iterator[Row]:
    """Positions known to 5 cm, beside the same edges by others."""
    checks, worst, cpu, unity, inside = ([] for _ in range(5))
    peers: dict[Gicp, list[tuple[float, float, float]]] = {PLAIN: [], FINE: []}
    for seed, case in surveys("known"):
        found, T, cpu_s = registered(case)
        errors = pose_errors(T, case)
        checks.append(errors.check_mm)
        worst.append(max(errors.station_mm.values()))
        cpu.append(cpu_s)
        d2 = _normalised(found, errors)
        unity.append(float(np.mean(d2)) / 6)
        inside.append(100 * float(np.mean(np.array(d2) < IN_99)))
        scans_m = {one.name: read_scan(path).points_m for one, path in case.given}
        pairs = [(p.source, p.target, _nearly(case, p.source, p.target, seed)) for p in found.pairs]
        for gicp, of_seeds in peers.items():
            edges, peer_s = edges_of(gicp, scans_m, pairs)
            peer = pose_errors(_adjusted(found, pairs, edges), case)
            of_seeds.append((peer.check_mm, max(peer.station_mm.values()), cpu_s / peer_s))
    known = _bridge(f"{len(SEEDS)} seeds")
    ours = {"check points": ("mm RMSE", _median(checks)), "worst station": ("mm", _median(worst))}
    for gicp, of_seeds in peers.items():
        check, station, ratio = np.median(np.array(of_seeds), axis=0)
        theirs = f"{gicp.name}, same edges, our pose graph"
        for (what, (unit, value)), peer_value in zip(ours.items(), (check, station), strict=True):
            yield row(
                f"positions to 5 cm: {what}", value, unit, "≤ 2", **known, peer=theirs, peer_value=peer_value
            )
        bar = "≤ 1.3" if station <= 2.0 else None  # a peer that misses the accuracy is no measure of time
        what = "positions to 5 cm: CPU time, to the peer's"
        yield row(what, ratio, "1", bar, **known, peer=theirs, peer_value=1.0)
    yield row("positions to 5 cm: CPU time", _median(cpu), "s", None, **known)
    yield row("covariances: mean d²/6", float(np.mean(unity)), "1", None, **known)
    yield row("covariances: inside 99 %", float(np.mean(inside)), "%", None, **known)


def targets() -> Iterator[Row]:
    """The datum by surveyed targets."""
    control, judged = [], []
    for seed, case in surveys("targets", COARSE_STEP_DEG):
        with_targets, surveyed = _with_targets(case, seed)
        tied, _, _ = registered(with_targets, surveyed)
        missed = [r for r in tied.targets if not r.check and not r.used]
        assert not missed and tied.targets
        for check, into in ((False, control), (True, judged)):
            squares = [np.square(r.residual_m).sum() for r in tied.targets if r.check == check]
            into.append(1000 * float(np.sqrt(np.mean(squares))))
    known = _bridge(f"{len(SEEDS)} seeds", COARSE_STEP_DEG)
    what = f"{TARGETS} targets to {1000 * TARGET_SIGMA_M:g} mm"
    yield row(f"{what}: control", _median(control), "mm RMSE", None, **known)
    yield row(f"{what}: check points in the datum", _median(judged), "mm RMSE", None, **known)


def no_poses() -> Iterator[Row]:
    """Nothing known: the whole set."""
    checks, worst, cpu, missing = [], [], [], 0
    for _, case in surveys("blind"):
        found, T, cpu_s = registered(case.without_positions())
        errors = pose_errors(T, case)
        checks.append(errors.check_mm)
        worst.append(max(errors.station_mm.values()))
        cpu.append(cpu_s)
        missing += len(found.left_out)
    known = _bridge(f"{len(SEEDS)} seeds")
    yield row("no poses: check points", _median(checks), "mm RMSE", "≤ 2", **known)
    yield row("no poses: worst station", _median(worst), "mm", "≤ 2", **known)
    yield row("no poses: stations lost", missing, "stations", "≤ 0", **known)
    yield row("no poses: CPU time", _median(cpu), "s", None, **known)


def blind_pairs() -> Iterator[Row]:
    """Nothing known: each overlapping pair for itself, before the fine step."""
    right: dict[str, list[bool]] = {"ours": [], **{name: [] for name in BLIND}}
    ours_on_some: list[bool] = []
    for _, case in surveys("pairs", COARSE_STEP_DEG):
        found, _, _ = registered(case)
        pairs = [(p.source, p.target) for p in found.pairs]
        placed = _placed_blindly(case.without_positions(), pairs)
        scans_m = {one.name: read_scan(path).points_m for one, path in case.given}
        for k, (source, target) in enumerate(pairs):
            truth = inverse(case.T_world_scan[target]) @ case.T_world_scan[source]
            right["ours"].append(_right(placed[k], truth))
            if k % EVERY == 0:
                ours_on_some.append(right["ours"][-1])
                for name, of_peer in BLIND.items():
                    right[name].append(_right(of_peer(scans_m[source], scans_m[target], 0.5), truth))
    seeds = f"{len(SEEDS)} seeds"
    what = "no poses: pairs right before the fine step"
    yield row(
        what,
        _share(right["ours"]),
        "%",
        "≥ 95",
        **_bridge(f"{len(right['ours'])} pairs of {seeds}", COARSE_STEP_DEG),
    )
    known = _bridge(f"{len(ours_on_some)} pairs of {seeds}", COARSE_STEP_DEG)
    what = f"no poses: pairs right, of every {EVERY}th"
    for name in BLIND:
        peer = {"peer": name, "peer_value": _share(right[name])}
        yield row(what, _share(ours_on_some), "%", None, **known, **peer)


def every_fault() -> Iterator[Row]:
    checks, worst, lost = [], [], 0
    for seed in SEEDS:
        scanning = scan_faults.every_fault(seed).model_copy(update={"step_deg": STEP_DEG})
        with TemporaryDirectory() as name:
            case = survey(nine_station_bridge(seed), scanning, Path(name))
            found, T, _ = registered(case)
        errors = pose_errors(T, case)
        checks.append(errors.check_mm)
        worst.append(max(errors.station_mm.values()))
        lost += len(found.left_out)
    known: dict[str, Any] = {
        "data": "simulated bridge, 9 stations, every fault",
        "seed": f"{len(SEEDS)} seeds",
    }
    yield row("every fault: check points", _median(checks), "mm RMSE", "≤ 5", **known)
    yield row("every fault: worst station", _median(worst), "mm", "≤ 8", **known)
    yield row("every fault: stations lost", lost, "stations", "≤ 0", **known)


def wrong_pose() -> Iterator[Row]:
    """All poses stated, one wrong by 10 m and 180°."""
    worst, lost = [], 0
    for seed, case in surveys("wrong", COARSE_STEP_DEG):
        given = []
        for k, (one, path) in enumerate(case.given):
            T = case.T_world_scan[one.name]
            stated = yaw(np.pi, (10.0, 0.0, 0.0)) @ T if k == seed - 1 else T
            rows = tuple(tuple(float(x) for x in row) for row in stated)
            given.append((one.model_copy(update={"station_position_m": None, "T_world_scan": rows}), path))
        found, T_found, _ = registered(Survey(tuple(given), case.T_world_scan, case.checks_m))
        lost += len(found.left_out)
        worst.append(max(pose_errors(T_found, case).station_mm.values()))
    known = _bridge(f"{len(SEEDS)} seeds", COARSE_STEP_DEG)
    yield row("one pose wrong by 10 m and 180°: worst station", _median(worst), "mm", "≤ 2", **known)
    yield row("one pose wrong by 10 m and 180°: stations lost", lost, "stations", "≤ 0", **known)


def refusals() -> Iterator[Row]:
    """Ten times a station of another place among six of the bridge, ten times three among them."""
    right = []
    scanning = Scanning(step_deg=COARSE_STEP_DEG)
    for seed in REFUSAL_SEEDS:
        with TemporaryDirectory() as name:
            ours = survey(bridge.bridge(seed), scanning, Path(name))
            others = survey(arch.arch(seed), scanning, Path(name), "other-")
            right += _refused(ours, others, seed)
    data = f"simulated bridge and arch, {COARSE_STEP_DEG}° steps, no poses"
    what = "stations of another structure refused by name, the bridge's all kept"
    yield row(what, sum(right), f"of {len(right)}", f"≥ {len(right)}", data, f"{len(REFUSAL_SEEDS)} seeds")


def _refused(ours: Survey, others: Survey, seed: int) -> list[bool]:
    right = []
    for strangers in (1, 3):
        chosen = [others.given[(seed + k) % len(others.given)] for k in range(strangers)]
        mixed = Survey((*ours.given, *chosen), {}, {}).without_positions()
        found, _, _ = registered(mixed)
        right.append(
            {s.name for s in found.stations} == {one.name for one, _ in ours.given}
            and {left.item for left in found.left_out} == {one.name for one, _ in chosen}
        )
    return right


PARTS = {
    "known-positions": known_positions,
    "targets": targets,
    "no-poses": no_poses,
    "blind-pairs": blind_pairs,
    "every-fault": every_fault,
    "wrong-pose": wrong_pose,
    "refusals": refusals,
}


def surveys(
    name: str, step_deg: float = STEP_DEG, seeds: Sequence[int] = SEEDS
) -> Iterator[tuple[int, Survey]]:
    """The nine-station bridge of each seed, its files gone when the next one comes."""
    for seed in seeds:
        with TemporaryDirectory(prefix=f"{name}-") as folder:
            yield seed, survey(nine_station_bridge(seed), Scanning(step_deg=step_deg), Path(folder))


def _bridge(seeds: str, step_deg: float = STEP_DEG) -> dict[str, Any]:
    return {"data": f"simulated bridge, 9 stations, {step_deg}° steps", "seed": seeds}


def _placed_blindly(case: Survey, pairs: Sequence[tuple[str, str]]) -> list[Array | None]:
    """The coarse T_target_source of each pair (source, target), alone and of which nothing is known."""
    with TemporaryDirectory() as name:
        sites, _ = load_stations(case.given, SETTINGS, Shelf(Path(name)), lambda _: None)
        voxel_m = max(float(np.median([s.coarse_voxel_m for s in sites])), SETTINGS.tau_m)
        shapes = [shape(s, voxel_m) for s in sites]
    at = {s.name: k for k, s in enumerate(sites)}
    found: list[Array | None] = []
    for pair in pairs:
        source, target = (at[name] for name in pair)
        two = [target, source]
        placed = place(
            [sites[k] for k in two], [shapes[k] for k in two], voxel_m, SETTINGS.min_overlap, lambda _: None
        )
        found.append(placed.T_frame_local.get(1))
    return found


def _right(T: Array | None, truth: Array) -> bool:
    if T is None:
        return False
    delta = inverse(truth) @ T
    return bool(angle_deg(delta) < RIGHT_DEG and np.linalg.norm(delta[:3, 3]) < RIGHT_M)


def _nearly(case: Survey, source: str, target: str, seed: int) -> Array:
    """The true T_target_source, off as coarse alignment leaves it: 5 cm and 0.5°."""
    rng = np.random.default_rng([seed, len(source), sum(map(ord, source + target))])
    off = np.concatenate([rng.normal(0, np.radians(0.5), 3), rng.normal(0, 0.05, 3)])
    truth = inverse(case.T_world_scan[target]) @ case.T_world_scan[source]
    return np.asarray(truth @ exp(off))


def _adjusted(
    found: Registration, pairs: Sequence[tuple[str, str, Array]], T_edges: Sequence[Array]
) -> dict[str, Array]:
    """Our pose graph of a peer's edges, each weighed as ours of the same pair."""
    names = [s.name for s in found.stations]
    edges = [
        Edge(
            names.index(s),
            names.index(t),
            T,
            np.diag([p.inliers * 50.0] * 3 + [p.inliers / 3] * 3),
            p.inliers,
            p.rmse_m,
        )
        for (s, t, _), T, p in zip(pairs, T_edges, found.pairs, strict=True)
    ]
    poses, _ = optimise(spanning_start(len(names), edges), edges)
    return dict(zip(names, poses, strict=True))


def _normalised(found: Registration, errors: PoseErrors) -> list[float]:
    """d² of each station's error in its own covariance."""
    return [
        float(errors.xi[s.name] @ np.linalg.pinv(np.array(s.covariance), rcond=1e-9) @ errors.xi[s.name])
        for s in found.stations
    ]


def _with_targets(case: Survey, seed: int) -> tuple[Survey, tuple[SiteTarget, ...]]:
    """Spheres about the bridge, each seen by three stations; every other one is a check point. The datum is
    a national grid."""
    rng = np.random.default_rng([seed, 0x54617267])
    places_m = np.column_stack(
        [rng.uniform(-12, 12, TARGETS), rng.uniform(-12, 12, TARGETS), rng.uniform(0.5, 6, TARGETS)]
    )
    to_grid = yaw(0.4, (512_345.0, 5_432_100.0, 87.0))
    surveyed = tuple(
        SiteTarget(name=f"S{k}", position_m=tuple(transform(to_grid, p[None])[0].tolist()), check=k % 2 == 1)
        for k, p in enumerate(places_m)
    )
    given = []
    for k, (one, path) in enumerate(case.given):
        back = inverse(case.T_world_scan[one.name])
        seen = tuple(
            SeenTarget(
                name=f"S{j}",
                position=tuple((transform(back, p[None])[0] + rng.normal(0, TARGET_SIGMA_M, 3)).tolist()),
            )
            for j, p in enumerate(places_m)
            if (j + k) % 3 == 0
        )
        given.append((one.model_copy(update={"targets": seen}), path))
    return Survey(tuple(given), case.T_world_scan, case.checks_m), surveyed


def _share(right: Sequence[bool]) -> float:
    return 100 * float(np.mean(right))


def _median(values: Sequence[float]) -> float:
    return float(np.median(values))
