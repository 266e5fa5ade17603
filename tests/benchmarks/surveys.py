"""Surveys for the benchmark of registration: scan files as a crew brings them, and their truth."""

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import numpy.typing as npt

from artifacts.store import digest
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
LOOSE = ("ground", "leaf", "metal")  # materials of what is no structure
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


def survey(scene: Scene, scanning: Scanning, folder: Path, prefix: str = "") -> Survey:
    """The scene scanned from all its stations into PLY files of the folder."""
    folder.mkdir(parents=True, exist_ok=True)
    given, truth, checks = [], {}, {}
    firm = np.array([face.material not in LOOSE for face in scene.faces])
    for sweep in scan(scene, lambda _: None, scanning):
        name = prefix + sweep.name
        path = folder / f"{name}.ply"
        write_ply(sweep.points, path)
        file = File(sha256=digest(path), size=path.stat().st_size, suffix=".ply")
        given.append((Scan(name=name, file=file, station_position_m=sweep.measured_m), path))
        truth[name] = sweep.T_world_scan
        on = np.flatnonzero((sweep.face >= 0) & firm[np.maximum(sweep.face, 0)])
        checks[name] = sweep.points[on[:: max(1, len(on) // CHECK_POINTS)]].astype(float)
    return Survey(tuple(given), truth, checks)


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
