"""A small site of known shape, scanned by ray casting: ground, two piers, a deck, and things beside them."""

from pathlib import Path

import numpy as np
import numpy.typing as npt
import open3d as o3d

from artifacts.store import digest
from schemas.file import File
from schemas.scan import Scan
from tasks.registration.rigid_motion import Array, fit, inverse, transform, yaw

Box = tuple[tuple[float, float, float], tuple[float, float, float]]  # least and greatest corner, metres

BRIDGE: tuple[Box, ...] = (  # nearly symmetric, as bridges are
    ((-30, -30, -1), (30, 30, 0)),
    ((-6, -2.5, 0), (-5, 2.5, 5)),
    ((5, -2.5, 0), (6.2, 2.5, 5)),
    ((-8, -3, 5), (8, 3, 5.6)),
    ((-8, -3.1, 5.6), (8, -2.9, 6.5)),
    ((1, 5, 0), (2.5, 7, 1.8)),
    ((-9, -8, 0), (-7, -4.5, 2.6)),
    ((9, 2, 0), (10, 3, 4)),
    ((-3, -9, 0), (-2.4, -6, 1.2)),
    ((-12, 6, 0), (-9, 7, 3)),
)
YARD: tuple[Box, ...] = (  # another place
    ((-30, -30, -1), (30, 30, 0)),
    ((-10, -6, 0), (-7, -3, 5)),
    ((4, 6, 0), (5, 10, 3)),
    ((7, -8, 0), (10, -7, 2)),
    ((-4, 9, 0), (1, 10, 6)),
    ((-12, 3, 0), (-11, 5, 2.2)),
)
NOISE_M = 0.003
POSITIONS_M = ((-9.0, 4.0, 1.7), (0.0, -6.0, 1.6), (8.5, 5.0, 1.7), (0.5, 3.5, 1.5))
STEP_DEG = 0.8


def pose_of(station: int) -> Array:
    """T_world_scan: a levelled scanner with any yaw."""
    angle = np.random.default_rng(station).uniform(0, 2 * np.pi)
    return yaw(float(angle), POSITIONS_M[station])


def points_seen(boxes: tuple[Box, ...], T_world_scan: Array, seed: int) -> npt.NDArray[np.float64]:
    """(N, 3) points in the scanner's frame, 3 mm range noise, range up to 30 m."""
    scene = o3d.t.geometry.RaycastingScene()
    for low, high in boxes:
        box = o3d.geometry.TriangleMesh.create_box(*(float(s) for s in np.subtract(high, low)))
        scene.add_triangles(
            o3d.t.geometry.TriangleMesh.from_legacy(box.translate(np.array(low, dtype=float)))
        )
    azimuth = np.radians(np.arange(0, 360, STEP_DEG))
    elevation = np.radians(np.arange(-60, 90, STEP_DEG))
    a, e = (x.ravel() for x in np.meshgrid(azimuth, elevation))
    rays = np.column_stack([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])
    world = np.column_stack([np.tile(T_world_scan[:3, 3], (len(rays), 1)), rays @ T_world_scan[:3, :3].T])
    hit_m = scene.cast_rays(o3d.core.Tensor(world.astype(np.float32)))["t_hit"].numpy()
    seen = hit_m < 30
    noise_m = np.random.default_rng([seed, 1]).normal(0, NOISE_M, int(seen.sum()))
    return np.asarray(rays[seen] * (hit_m[seen].astype(np.float64) + noise_m)[:, None])


def write_ply(path: Path, points_m: npt.NDArray[np.floating]) -> Path:
    head = f"ply\nformat binary_little_endian 1.0\nelement vertex {len(points_m)}\n"
    head += "property float x\nproperty float y\nproperty float z\nend_header\n"
    path.write_bytes(head.encode() + points_m.astype("<f4").tobytes())
    return path


def as_scan(path: Path, **known: object) -> tuple[Scan, Path]:
    file = File(sha256=digest(path), size=path.stat().st_size, suffix=path.suffix)
    return Scan.model_validate({"name": path.stem, "file": file, **known}), path


def measured_position(station: int) -> tuple[float, float, float]:
    """As a crew measures it, to 5 cm (1σ)."""
    x, y, z = pose_of(station)[:3, 3] + np.random.default_rng([station, 2]).normal(0, 0.05, 3)
    return float(x), float(y), float(z)


def errors_mm_deg(found: list[Array], truth: list[Array]) -> tuple[float, float]:
    """Greatest error of the stations' positions and turns after one motion of all: the gauge is no error."""
    tips = np.vstack([np.eye(3) * 10, np.zeros(3)])
    gauge = fit(
        np.concatenate([transform(T, tips) for T in found]),
        np.concatenate([transform(T, tips) for T in truth]),
    )
    apart = [inverse(t) @ gauge @ f for f, t in zip(found, truth, strict=True)]
    turned = [np.degrees(np.linalg.norm(T[:3, :3] - np.eye(3)) / np.sqrt(2)) for T in apart]
    return max(float(np.linalg.norm(T[:3, 3])) * 1000 for T in apart), float(max(turned))
