"""Registration of all stations: from scans in their own frames to one model in the world."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path

import numpy as np
import numpy.typing as npt

from schemas.problem import BadInput, LeftOut
from schemas.registered_model import ScanPair, Station
from schemas.scan import Scan
from schemas.settings import RegistrationSettings
from tasks.registration import world_frame
from tasks.registration.icp import Alignment, align
from tasks.registration.merged_model import Model, merge
from tasks.registration.overlap import overlap, overlapping
from tasks.registration.placement import LEAST_STABILITY, place
from tasks.registration.pose_graph import Edge, component, connected, optimise, spanning_start
from tasks.registration.read_scan import LARGE_COORDINATE_M, read_scan
from tasks.registration.rigid_motion import Array, inverse, pose, transform
from tasks.registration.station_cloud import Cloud, balanced_sample, coarse_voxel_m
from tasks.registration.station_site import Shape, Site, shape, site

STAGE = "register"
OVERLAP_POINTS = 20_000
FINE_POINTS = 30_000  # of a source in fine alignment: 3 mm noise averages out to hundredths


@dataclass(frozen=True)
class Registration:
    model: Model
    origin_m: Array  # (3,) model + origin = world
    stations: tuple[Station, ...]
    pairs: tuple[ScanPair, ...]
    left_out: tuple[LeftOut, ...]


def register(
    scans: Sequence[tuple[Scan, Path]],
    settings: RegistrationSettings,
    on_progress: Callable[[float], None] = lambda _: None,
) -> Registration:
    """Bring the scans into one frame and merge them.

    Scans that cannot be read, are given twice, or connect to nothing are left out by name. BadInput where
    none can be read, or no two of several connect. The world frame is that of the stated positions and
    poses where they fix it, else that of the first scan.
    """
    sites, left_out = _load(scans, settings, lambda f: on_progress(0.3 * f))
    voxel_m = max(coarse_voxel_m([s.fine for s in sites]), settings.tau_m)
    shapes = [shape(s, voxel_m) for s in sites]
    placed, *others = place(
        sites, shapes, voxel_m, settings.min_overlap, lambda f: on_progress(0.3 + 0.2 * f)
    )
    edges = []
    pairs = list(_candidate_pairs(placed.T_frame_local, shapes, voxel_m, settings.min_overlap))
    for k, (source, target, T_start) in enumerate(pairs):
        edge = _fine_edge(sites, shapes, source, target, T_start, settings)
        if edge is not None:
            edges.append(edge)
        on_progress(0.5 + 0.4 * (k + 1) / len(pairs))
    tied = sorted(component(min(placed.T_frame_local), [e.edge for e in edges]))
    loose = [i for other in others for i in other.T_frame_local]
    loose += [i for i in placed.T_frame_local if i not in tied]
    if len(tied) == 1 and len(sites) > 1:
        raise BadInput(
            ", ".join(s.name for s in sites),
            "no two of these scans overlap enough to be tied to each other",
            "Scan with more overlap between neighbouring stations, or state the stations' positions.",
        )
    left_out += [_disconnected(sites[i]) for i in sorted(loose)]
    kept = [e for e in edges if e.edge.source in tied]
    T_first, kept = _adjust(tied, kept, settings.tau_m / 2)
    T_world, origin_m = _in_world([sites[i] for i in tied], T_first)
    model = merge([sites[i].fine for i in tied], T_world, settings.voxel_m)
    stations = tuple(
        Station(
            name=sites[i].name,
            T_world_scan=_matrix(T @ pose(np.eye(3), -sites[i].shift_m)),
            points=sites[i].points,
        )
        for i, T in zip(tied, T_world, strict=True)
    )
    on_progress(1.0)
    scan_pairs = tuple(_scan_pair(e, sites) for e in kept)
    return Registration(model, origin_m, stations, scan_pairs, tuple(left_out))


@dataclass(frozen=True)
class _Tie:
    edge: Edge
    overlap: float
    rmse_m: float


def _load(
    scans: Sequence[tuple[Scan, Path]], settings: RegistrationSettings, on_progress: Callable[[float], None]
) -> tuple[list[Site], list[LeftOut]]:
    """Ready-made stations, one raw scan in memory at a time."""
    sites: list[Site] = []
    left_out: list[LeftOut] = []
    seen: dict[tuple[str, int], str] = {}
    problem = BadInput("scans", "no scan is given", "Name at least one scan.")
    for k, (scan, path) in enumerate(scans):
        try:
            twin = seen.setdefault((scan.file.sha256, scan.index), scan.name)
            if twin != scan.name or any(s.name == scan.name for s in sites):
                raise BadInput(scan.name, f"it is the same scan as {twin}", "Give each scan once.")
            loaded = read_scan(path, scan.index, scan.unit_m, scan.name)
            sites.append(site(scan, loaded, settings.voxel_m))
        except BadInput as bad:
            problem = bad
            left_out.append(LeftOut.because(STAGE, bad))
        on_progress((k + 1) / len(scans))
    if not sites:
        if len(scans) <= 1:
            raise problem
        raise BadInput(
            ", ".join(item.item for item in left_out),
            "none of the scans can be used: " + "; ".join(f"{i.item}: {i.what}" for i in left_out),
            "Export the scans again.",
        )
    return sites, left_out


def _candidate_pairs(
    T_frame_local: dict[int, Array], shapes: Sequence[Shape], voxel_m: float, min_overlap: float
) -> Iterator[tuple[int, int, Array]]:
    """(source, target, T_target_source) of stations whose coarse clouds overlap as they were placed."""
    for source, target in combinations(sorted(T_frame_local), 2):
        T = inverse(T_frame_local[target]) @ T_frame_local[source]
        found = overlap(shapes[source].cloud, shapes[target].cloud, T, voxel_m)
        back = overlap(shapes[target].cloud, shapes[source].cloud, inverse(T), voxel_m)
        if (
            max(found.share, back.share) >= min_overlap
            and min(found.stability, back.stability) >= LEAST_STABILITY
        ):
            yield source, target, T


def _fine_edge(
    sites: Sequence[Site],
    shapes: Sequence[Shape],
    source: int,
    target: int,
    T_start: Array,
    settings: RegistrationSettings,
) -> _Tie | None:
    """The tie of two stations, or None where they do not overlap by the paper's τ as much as is asked."""
    voxel_m = shapes[source].voxel_m
    sample = balanced_sample(shapes[source].middle, FINE_POINTS, settings.seed)
    found: Alignment | None = align(sample, shapes[target].middle, T_start, (voxel_m, voxel_m / 2))
    if found is None:
        return None
    T = found.T_target_source
    moved_m = transform(T, sample.points_m) - transform(T_start, sample.points_m)
    if np.linalg.norm(moved_m, axis=1).mean() > 4 * voxel_m:
        return None
    one, other = sites[source].fine, sites[target].fine
    near = overlapping(_some(one), other, T, settings.tau_m).mean()
    back = overlapping(_some(other), one, inverse(T), settings.tau_m).mean()
    if max(near, back) < settings.min_overlap:
        return None
    return _Tie(Edge(source, target, T, found.information, found.inliers), float(near), found.rmse_m)


def _some(cloud: Cloud) -> npt.NDArray[np.float32]:
    """Evenly chosen points, enough to tell a share of them to half a percent."""
    return cloud.points_m[:: max(1, len(cloud) // OVERLAP_POINTS)]


def _adjust(tied: list[int], ties: list[_Tie], wrong_m: float) -> tuple[list[Array], list[_Tie]]:
    """Poses of the tied stations in the frame of the first; the ties that agree with them to `wrong_m`."""
    at = {station: k for k, station in enumerate(tied)}
    edges = [
        Edge(at[t.edge.source], at[t.edge.target], t.edge.T_target_source, t.edge.information, t.edge.inliers)
        for t in ties
    ]
    T_first, apart_m = optimise(spanning_start(len(tied), edges), edges)
    agree = [k for k, apart in enumerate(apart_m) if apart < wrong_m]
    if len(agree) < len(edges) and connected(len(tied), [edges[k] for k in agree]):
        T_first, _ = optimise(T_first, [edges[k] for k in agree])
        ties = [ties[k] for k in agree]
    return T_first, ties


def _in_world(sites: Sequence[Site], T_first: Sequence[Array]) -> tuple[list[Array], Array]:
    """(T_world_local minus origin, origin) of each station."""
    scanners = [s.scanner_m for s in sites]
    positions = [s.position_m for s in sites]
    level = np.eye(4)
    if all(s.prior_T_world_local is None for s in sites) and any(p is not None for p in positions):
        level = world_frame.levelled(T_first)
    T_frame = [level @ T for T in T_first]
    T_world_frame = world_frame.fit(T_frame, [s.prior_T_world_local for s in sites], scanners, positions)
    if T_world_frame is None:
        known = [
            (transform(T, s[None])[0], p)
            for T, s, p in zip(T_frame, scanners, positions, strict=True)
            if s is not None and p is not None
        ]
        first_scan = pose(np.eye(3), sites[0].shift_m)
        T_world_frame = world_frame.shift_only(*known[0]) if known else first_scan
    T_world = [T_world_frame @ T for T in T_frame]
    middle_m = np.median([T[:3, 3] for T in T_world], axis=0)
    origin_m = np.where(np.abs(middle_m) > LARGE_COORDINATE_M, np.round(middle_m, -2), 0.0)
    return [pose(np.eye(3), -origin_m) @ T for T in T_world], origin_m


def _disconnected(site: Site) -> LeftOut:
    return LeftOut(
        item=site.name,
        stage=STAGE,
        what="it overlaps no other scan enough to be tied to it",
        remedy="Scan again with more overlap, or state the station's position.",
    )


def _scan_pair(tie: _Tie, sites: Sequence[Site]) -> ScanPair:
    source, target = sites[tie.edge.source], sites[tie.edge.target]
    T = pose(np.eye(3), target.shift_m) @ tie.edge.T_target_source @ pose(np.eye(3), -source.shift_m)
    return ScanPair(
        source=source.name,
        target=target.name,
        T_target_source=_matrix(T),
        overlap=tie.overlap,
        rmse_m=tie.rmse_m,
        inliers=tie.edge.inliers,
    )


def _matrix(T: Array) -> tuple[tuple[float, float, float, float], ...]:
    return tuple((float(a), float(b), float(c), float(d)) for a, b, c, d in T)
