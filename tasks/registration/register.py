"""Registration of all stations: from scans in their own frames to one model in the world."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from schemas.contract import Matrix4, Matrix6
from schemas.problem import BadInput, LeftOut
from schemas.registered_model import ScanPair, Station
from schemas.scan import Scan
from schemas.settings import RegistrationSettings
from schemas.target import SiteTarget, TargetResidual
from tasks.registration import world_frame
from tasks.registration.cloud_shelf import Shelf
from tasks.registration.load_stations import STAGE, load_stations
from tasks.registration.merged_model import Model, merge
from tasks.registration.placement import place
from tasks.registration.pose_graph import (
    Edge,
    component,
    connected,
    covariances,
    optimise,
    spanning_start,
)
from tasks.registration.read_scan import LARGE_COORDINATE_M
from tasks.registration.rigid_motion import Array, pose, transform
from tasks.registration.site_datum import Sighting, residuals, tie_to_datum, unused
from tasks.registration.stated_unit import other_unit
from tasks.registration.station_site import Site, shape
from tasks.registration.ties import Tie, aligned, candidate_pairs, ties

NO_OVERLAP = "it overlaps no other scan enough to be tied to it"
STATE_POSITION = "State position_m of its station and of those beside, or its T_world_scan, or overlap more."


@dataclass(frozen=True)
class Registration:
    model: Model
    origin_m: Array  # (3,) model + origin = world
    stations: tuple[Station, ...]
    pairs: tuple[ScanPair, ...]
    targets: tuple[TargetResidual, ...]
    left_out: tuple[LeftOut, ...]


def register(
    scans: Sequence[tuple[Scan, Path]],
    settings: RegistrationSettings,
    model_path: Path,
    targets: Sequence[SiteTarget] = (),
    on_progress: Callable[[float], None] = lambda _: None,
) -> Registration:
    """Bring the scans into one frame and write their merged model, a PLY, to `model_path`.

    Scans that cannot be read, are given twice, or connect to nothing are left out by name. BadInput where
    none can be read, where no two of several connect, and, if settings ask for all, where one does not.
    The world frame is the datum of the control targets; without any, that of the stated positions and poses
    where they fix it, else that of the first scan. At work the clouds lie in files beside the model, a few at
    a time in memory.
    """
    with TemporaryDirectory(dir=model_path.parent, prefix="clouds-") as name:
        folder = Path(name)
        shelf = Shelf(folder)
        sites, left_out = load_stations(scans, settings, shelf, lambda f: on_progress(0.4 * f))
        tied, T_first, kept, rival_m = _tie_together(sites, settings, lambda f: on_progress(0.4 + 0.5 * f))
        loose = [_untied(site, rival_m.get(i), sites) for i, site in enumerate(sites) if i not in tied]
        _refuse(sites, loose, settings.require_all)
        sites = [sites[i] for i in tied]
        T_world, origin_m, T_world_first, found, unused_targets = _in_world(sites, T_first, targets)
        model = merge([s.fine for s in sites], T_world, settings.voxel_m, folder, model_path)
    on_progress(1.0)
    return Registration(
        model=model,
        origin_m=origin_m,
        stations=_stations(sites, T_first, T_world, T_world_first, [t.edge for t in kept]),
        pairs=tuple(_scan_pair(one, sites) for one in kept),
        targets=found,
        left_out=(*left_out, *loose, *unused_targets),
    )


def _tie_together(
    sites: Sequence[Site], settings: RegistrationSettings, on_progress: Callable[[float], None]
) -> tuple[list[int], list[Array], list[Tie], dict[int, float]]:
    """Stations of the largest component, their poses in the frame of its first, and the ties between them by
    their place in that list; of the others, those that fit in several places, and how far these are apart."""
    voxel_m = max(float(np.median([s.coarse_voxel_m for s in sites])), settings.tau_m)
    shapes = [shape(s, voxel_m) for s in sites]
    placed = place(sites, shapes, voxel_m, settings.min_overlap, lambda f: on_progress(0.4 * f))
    edges = []
    pairs = list(candidate_pairs(placed.T_frame_local, shapes, voxel_m, settings.min_overlap))
    for k, (source, target, T_start) in enumerate(pairs):
        edge = aligned(shapes, source, target, T_start, settings)
        if edge is not None:
            edges.append(edge)
        on_progress(0.4 + 0.5 * (k + 1) / len(pairs))
    all_ties = ties(sites, edges, settings)
    tied = sorted(component(min(placed.T_frame_local), [t.edge for t in all_ties]))
    at = {station: k for k, station in enumerate(tied)}
    kept = [
        replace(t, edge=replace(t.edge, source=at[t.edge.source], target=at[t.edge.target]))
        for t in all_ties
        if t.edge.source in at
    ]
    T_first, kept = _adjust(len(tied), kept, settings.tau_m / 2)
    return tied, T_first, kept, placed.rival_m


def _adjust(stations: int, ties: list[Tie], wrong_m: float) -> tuple[list[Array], list[Tie]]:
    """Poses in the frame of the first station; the ties that agree with them to `wrong_m`."""
    edges = [t.edge for t in ties]
    T_first, apart_m = optimise(spanning_start(stations, edges), edges)
    agree = [k for k, apart in enumerate(apart_m) if apart < wrong_m]
    if len(agree) < len(edges) and connected(stations, [edges[k] for k in agree]):
        T_first, _ = optimise(T_first, [edges[k] for k in agree])
        ties = [ties[k] for k in agree]
    return T_first, ties


def _refuse(sites: Sequence[Site], loose: Sequence[LeftOut], require_all: bool) -> None:
    none_tied = len(sites) > 1 and len(loose) == len(sites) - 1
    unsure = [one for one in loose if one.what != NO_OVERLAP]
    if unsure and (none_tied or require_all):
        why = "; ".join(f"{one.item}: {one.what}" for one in unsure)
        raise BadInput(
            ", ".join(one.item for one in unsure), f"they cannot be tied for sure: {why}", STATE_POSITION
        )
    if none_tied:
        raise BadInput(
            ", ".join(s.name for s in sites),
            "no two of these scans overlap enough to be tied to each other",
            "Scan with more overlap between neighbouring stations, or state the stations' positions."
            + next(filter(None, (_other_unit(s, sites) for s in sites)), ""),
        )
    if loose and require_all:
        raise BadInput(
            ", ".join(one.item for one in loose),
            "no overlap ties them to the other scans, and all are required",
            "Scan again with more overlap, or set require_all to false to go on without them.",
        )


def _in_world(
    sites: Sequence[Site], T_first: Sequence[Array], targets: Sequence[SiteTarget]
) -> tuple[list[Array], Array, Array, tuple[TargetResidual, ...], list[LeftOut]]:
    """(T_world_local minus origin, origin, T_world_first, residuals, targets without a say)."""
    scanners = [s.scanner_m for s in sites]
    positions = [s.position_m for s in sites]
    level = np.eye(4)
    if all(s.prior_T_world_local is None for s in sites) and (
        targets or any(p is not None for p in positions)
    ):
        level = world_frame.levelled(T_first)
    T_frame = [level @ T for T in T_first]
    surveyed = {target.name: target for target in targets}
    sightings = [
        Sighting(surveyed[name], site.name, transform(T, place_m[None])[0])
        for site, T in zip(sites, T_frame, strict=True)
        for name, place_m in site.targets_m.items()
        if name in surveyed
    ]
    T_world_frame = tie_to_datum(sightings)
    if T_world_frame is None:
        T_world_frame = world_frame.fit(T_frame, [s.prior_T_world_local for s in sites], scanners, positions)
    if T_world_frame is None:
        known = [
            (transform(T, s[None])[0], p)
            for T, s, p in zip(T_frame, scanners, positions, strict=True)
            if s is not None and p is not None
        ]
        first_scan = pose(np.eye(3), sites[0].shift_m)
        T_world_frame = world_frame.shift_only(*known[0]) if known else first_scan
    found = residuals(sightings, T_world_frame)
    seen = [(site.name, name) for site in sites for name in site.targets_m]
    T_world = [T_world_frame @ T for T in T_frame]
    middle_m = np.median([T[:3, 3] for T in T_world], axis=0)
    origin_m = np.where(np.abs(middle_m) > LARGE_COORDINATE_M, np.round(middle_m, -2), 0.0)
    shifted = [pose(np.eye(3), -origin_m) @ T for T in T_world]
    return shifted, origin_m, T_world_frame @ level, found, unused(found, targets, seen)


def _stations(
    sites: Sequence[Site],
    T_first: Sequence[Array],
    T_world: Sequence[Array],
    T_world_first: Array,
    edges: Sequence[Edge],
) -> tuple[Station, ...]:
    scanners_m = [np.zeros(3) if s.scanner_m is None else s.scanner_m for s in sites]
    places_m = [transform(T, s[None])[0] for T, s in zip(T_first, scanners_m, strict=True)]
    turn = np.kron(np.eye(2), T_world_first[:3, :3])
    found = []
    for site, T, scanner_m, C in zip(
        sites, T_world, scanners_m, covariances(T_first, edges, places_m), strict=True
    ):
        x, y, z = transform(T, scanner_m[None])[0]
        found.append(
            Station(
                name=site.name,
                T_world_scan=_matrix(T @ pose(np.eye(3), -site.shift_m)),
                points=site.points,
                scanner_m=None if site.scanner_m is None else (float(x), float(y), float(z)),
                covariance=_matrix6(turn @ C @ turn.T) if len(sites) > 1 else None,
            )
        )
    return tuple(found)


def _untied(site: Site, rival_m: float | None, sites: Sequence[Site]) -> LeftOut:
    """Why the scan stands alone. rival_m: between places where it fits, if there are several."""
    if rival_m is None:
        remedy = "Scan again with more overlap, or state the station's position." + _other_unit(site, sites)
        return LeftOut(item=site.name, stage=STAGE, what=NO_OVERLAP, remedy=remedy)
    what = f"it fits in more than one place about equally well, {rival_m:.1f} m apart"
    return LeftOut(item=site.name, stage=STAGE, what=what, remedy=STATE_POSITION)


def _other_unit(site: Site, sites: Sequence[Site]) -> str:
    return other_unit(site.name, {one.name: one.sample_m for one in sites})


def _scan_pair(tied: Tie, sites: Sequence[Site]) -> ScanPair:
    source, target = sites[tied.edge.source], sites[tied.edge.target]
    T = pose(np.eye(3), target.shift_m) @ tied.edge.T_target_source @ pose(np.eye(3), -source.shift_m)
    return ScanPair(
        source=source.name,
        target=target.name,
        T_target_source=_matrix(T),
        overlap=tied.overlap,
        rmse_m=tied.edge.rmse_m,
        inliers=tied.edge.inliers,
    )


def _matrix(T: Array) -> Matrix4:
    a, b, c, d = ((float(w), float(x), float(y), float(z)) for w, x, y, z in T)
    return a, b, c, d


def _matrix6(C: Array) -> Matrix6:
    a, b, c, d, e, f = (
        (float(u), float(v), float(w), float(x), float(y), float(z)) for u, v, w, x, y, z in C
    )
    return a, b, c, d, e, f
