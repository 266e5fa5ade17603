"""Surveys for the benchmark of registration: scan files as a crew brings them, and their truth."""

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import numpy.typing as npt

from artifacts.store import digest
from schemas.contract import Vector3
from schemas.file import File
from schemas.scan import Scan
from schemas.scanning import Scanning
from schemas.settings import RegistrationSettings
from schemas.target import SiteTarget
from tasks.registration.register import Registration, register
from tasks.registration.rigid_motion import Array, fit, inverse, transform
from tasks.simulation import bridge
from tasks.simulation.scanner import scan, write_ply
from tasks.simulation.scene import Scene

SETTINGS = RegistrationSettings()
MORE_STATIONS_M = ((-10.5, -1.0, 1.65), (10.5, 1.5, 1.6), (0.5, -7.0, 1.7))  # of the bridge, in its frame
SPAN_M = 12.6
LOOSE = ("ground", "leaf", "metal")  # materials of what is no structure
LOOK_SIGMA_M = 0.002
CHECK_POINTS = 400  # of each station


@dataclass(frozen=True)
class Survey:
    given: tuple[tuple[Scan, Path], ...]  # with the positions as they were measured
    T_world_scan: dict[str, Array]  # true
    checks_m: dict[str, Array]  # (N, 3) points of the structure, in each scan's frame

    def without_positions(self) -> "Survey":
        blind = tuple((one.model_copy(update={"station_position_m": None}), path) for one, path in self.given)
        return replace(self, given=blind)

    def of(self, names: Sequence[str]) -> "Survey":
        return replace(self, given=tuple(item for item in self.given if item[0].name in names))


@dataclass(frozen=True)
class PoseErrors:
    """After one motion of all stations together: no datum, no error."""

    check_mm: float  # RMSE of the check points of all stations
    station_mm: dict[str, float]  # of each
    xi: dict[str, Array]  # (6,) turn (radians) and shift (metres) of each scanner, world axes


def nine_station_bridge(seed: int) -> Scene:
    scene = bridge.bridge(seed)
    more = tuple(bridge.PLACE.point(place) for place in MORE_STATIONS_M)
    return replace(scene, stations_m=(*scene.stations_m, *more))


def viaduct(seed: int, stations: int) -> Scene:
    """The bridge many times over, one span beside the next, and stations along it, nine or so a span."""
    scene = nine_station_bridge(seed)
    along = bridge.PLACE.point((SPAN_M, 0.0, 0.0)) - np.asarray(bridge.PLACE.point((0.0, 0.0, 0.0)))
    spans = -(-stations // len(scene.stations_m))
    ground, *span = sorted(scene.faces, key=lambda face: face.material != "ground")
    faces = [replace(ground, width_m=ground.width_m + spans * SPAN_M)]
    for k in range(spans):
        faces += [replace(f, name=f"{f.name}-{k}", origin_m=_moved(f.origin_m, k * along)) for f in span]
    places = [_moved(place, k * along) for k in range(spans) for place in scene.stations_m]
    return replace(scene, faces=tuple(faces), stations_m=tuple(places[:stations]))


def _moved(place_m: Vector3, by_m: Array) -> Vector3:
    x, y, z = np.add(place_m, by_m).tolist()
    return x, y, z


def survey(scene: Scene, scanning: Scanning, folder: Path, prefix: str = "", *, looks: int = 1) -> Survey:
    """The scene scanned from all its stations into PLY files of the folder. looks: how many times each
    point is in its file, each a little elsewhere: scans of many points without as many rays."""
    folder.mkdir(parents=True, exist_ok=True)
    given, truth, checks = [], {}, {}
    firm = np.array([face.material not in LOOSE for face in scene.faces])
    for sweep in scan(scene, lambda _: None, scanning):
        name = prefix + sweep.name
        path = folder / f"{name}.ply"
        write_ply(sweep.points if looks == 1 else _looked_at(sweep.points, looks), path)
        file = File(sha256=digest(path), size=path.stat().st_size, suffix=".ply")
        given.append((Scan(name=name, file=file, station_position_m=sweep.measured_m), path))
        truth[name] = sweep.T_world_scan
        on = np.flatnonzero((sweep.face >= 0) & firm[np.maximum(sweep.face, 0)])
        checks[name] = sweep.points[on[:: max(1, len(on) // CHECK_POINTS)]].astype(float)
    return Survey(tuple(given), truth, checks)


def _looked_at(points: npt.NDArray[np.float32], looks: int) -> npt.NDArray[np.float32]:
    rng = np.random.default_rng(len(points))
    shifts = rng.normal(0.0, LOOK_SIGMA_M, (looks, 3)).astype(np.float32)
    return (points[:, None] + shifts).reshape(-1, 3)


def pose_errors(found: dict[str, npt.NDArray[np.float64]], survey: Survey) -> PoseErrors:
    """T_world_scan as found, by station, against the truth."""
    names = sorted(found)
    ours = [transform(found[n], survey.checks_m[n]) for n in names]
    true = [transform(survey.T_world_scan[n], survey.checks_m[n]) for n in names]
    gauge = fit(np.concatenate(ours), np.concatenate(true))
    square = {
        n: ((transform(gauge, p) - q) ** 2).sum(axis=1) for n, p, q in zip(names, ours, true, strict=True)
    }
    xi = {}
    for n in names:
        apart = gauge @ found[n] @ inverse(survey.T_world_scan[n])
        R = apart[:3, :3]
        turn = np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]]) / 2
        xi[n] = np.concatenate([turn, (gauge @ found[n] - survey.T_world_scan[n])[:3, 3]])
    return PoseErrors(
        1000 * float(np.sqrt(np.mean(np.concatenate(list(square.values()))))),
        {n: 1000 * float(np.sqrt(s.mean())) for n, s in square.items()},
        xi,
    )


def registered(
    survey: Survey, targets: Sequence[SiteTarget] = ()
) -> tuple[Registration, dict[str, Array], float]:
    """(result, T_world_scan by station, CPU seconds)."""
    began = time.process_time()
    with TemporaryDirectory() as folder:
        found = register(survey.given, SETTINGS, Path(folder) / "model.ply", targets)
    cpu_s = time.process_time() - began
    return found, {s.name: np.array(s.T_world_scan) for s in found.stations}, cpu_s
