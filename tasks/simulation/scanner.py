"""A terrestrial laser scanner: rays cast from tripods around the scene, with a scanner's errors."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import Rotation

from schemas.contract import Vector3
from schemas.scanning import Scanning
from tasks.simulation.face import Array, vector
from tasks.simulation.scan_faults import astray_m, misread, mixed, range_error_m, returned
from tasks.simulation.scan_target import NOTHING, ScanTarget
from tasks.simulation.scene import Scene
from tasks.simulation.traffic import met_faces

LOWEST_DEG, HIGHEST_DEG = -55.0, 90.0
RANGE_M = (0.6, 80.0)
QUIET = Scanning()


@dataclass(frozen=True)
class Sweep:
    """One station's scan. points: (N, 3) float32 metres in the scanner's frame. face: (N,) which face of the
    scene each is of; scan_target.MIXED where the beam met two things, NOTHING for who passed by."""

    name: str
    points: npt.NDArray[np.float32]
    face: npt.NDArray[np.int32]
    measured_m: Vector3
    T_world_scan: Array  # (4, 4) true


def scan(scene: Scene, progress: Callable[[float], None], scanning: Scanning = QUIET) -> Iterator[Sweep]:
    """Scan the scene from each of its stations; frames are levelled, their yaw is arbitrary."""
    azimuth, elevation = _angles(scanning.step_deg)
    shape = azimuth.shape
    azimuth, elevation = azimuth.ravel(), elevation.ravel()
    directions = _towards(azimuth, elevation)
    shown = _towards(*misread(azimuth, elevation, scanning))
    off = astray_m(scanning, len(scene.stations_m), scene.seed)
    moving = bool(scanning.people or scanning.cars or scanning.sway_m)
    target = ScanTarget(scene.faces, scene.seed)
    for number, station in enumerate(scene.stations_m):
        rng = np.random.default_rng([scene.seed, 0x5363616E, number])
        site = np.random.default_rng([scene.seed, 0x536974, number])
        faces = scene.faces
        if moving:
            faces = met_faces(scene, scanning.people, scanning.cars, scanning.sway_m, site)
            target = ScanTarget(faces, scene.seed)
        level = rng.normal(0.0, scanning.level_sigma_deg, 2)
        R = Rotation.from_euler("ZXY", [rng.uniform(0.0, 360.0), *level], degrees=True).as_matrix()
        rays = directions @ R.T
        hits = target.cast(station, rays)
        if scanning.beam_mrad:
            hits = mixed(target, station, rays, hits, shape, scanning.beam_mrad)
        hit = (hits.distance_m > RANGE_M[0]) & (hits.distance_m < RANGE_M[1])
        hit &= returned(hits, faces, scanning.reach_m, site)
        errors = np.radians(scanning.angle_sigma_deg) * rng.standard_normal((int(hit.sum()), 3))
        aim = shown[hit] + np.cross(errors, shown[hit])
        true_m = hits.distance_m[hit]
        range_m = true_m + range_error_m(true_m, scanning) + rng.normal(0.0, scanning.range_sigma_m, len(aim))
        T = np.eye(4)
        T[:3, :3], T[:3, 3] = R, station
        measured = np.asarray(station) + rng.normal(0.0, scanning.station_sigma_m, 3) + off[number]
        face = np.where(hits.face[hit] < len(scene.faces), hits.face[hit], NOTHING)
        yield Sweep(
            name=f"station-{number + 1}",
            points=(aim * range_m[:, None]).astype(np.float32),
            face=face.astype(np.int32),
            measured_m=vector(measured),
            T_world_scan=T,
        )
        progress((number + 1) / len(scene.stations_m))


def write_ply(points: npt.NDArray[np.float32], path: Path) -> None:
    """Binary PLY of (N, 3) float32 points."""
    header = (
        "ply\nformat binary_little_endian 1.0\ncomment metres, scanner's own frame\n"
        f"element vertex {len(points)}\nproperty float x\nproperty float y\nproperty float z\nend_header\n"
    )
    path.write_bytes(header.encode("ascii") + np.ascontiguousarray(points, dtype="<f4").tobytes())


def _angles(step_deg: float) -> tuple[Array, Array]:
    """(rows, columns) azimuths, clockwise from y, and elevations, radians."""
    azimuth = np.radians(np.arange(0.0, 360.0, step_deg))
    elevation = np.radians(np.arange(LOWEST_DEG, HIGHEST_DEG, step_deg))
    a, e = np.meshgrid(azimuth, elevation)
    return a, e


def _towards(azimuth: Array, elevation: Array) -> Array:
    """(N, 3) unit vectors in the scanner's frame."""
    a, e = azimuth, elevation
    return np.column_stack([np.sin(a) * np.cos(e), np.cos(a) * np.cos(e), np.sin(e)])
