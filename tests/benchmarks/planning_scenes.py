"""Structures that plans are measured on: a girder bridge of any length, walls among random obstacles, and the
simulator's scenes as a perfect scan would give them."""

from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
import numpy.typing as npt

from schemas.camera import Camera
from schemas.contract import Vector3
from schemas.file import File
from schemas.flight_plan import FlightPlan
from schemas.geodesy import GeoOrigin
from schemas.settings import PlanSettings
from schemas.structure import Structure
from schemas.surface import Surface
from schemas.vehicle import Vehicle
from tests.planning.structures import OPEN, points_on, rectangle

Array = npt.NDArray[np.float64]

SPACING_M = 0.05  # of the occupied points, as the extraction leaves them
GROUND_SPACING_M = 0.1
CORNER = np.array([4.0, 0.0, 0.0])  # where the two walls of a random scene meet
NO_FILE = File(sha256="0" * 64, size=0, suffix=".ply")


def structure_of(surfaces: list[Surface], points_m: Array, stations_m: tuple[Vector3, ...] = ()) -> Structure:
    low, high = points_m.min(axis=0), points_m.max(axis=0)
    return Structure(
        surfaces=tuple(surfaces), obstacles=(), occupied=NO_FILE,
        min_m=tuple(low.tolist()), max_m=tuple(high.tolist()), stations_m=stations_m,
    )  # fmt: skip


def girder_bridge(length_m: float) -> tuple[Structure, Array]:
    """A deck 10 m wide, 11 m up, on two girders 2 m deep and piers every 30 m, over flat ground; scanned from
    both sides every 15 m. To inspect: both sides of the girders, the soffit, the piers."""
    half = length_m / 2
    surfaces = [rectangle("ground-01", (0.0, 0.0, 0.0), (0, 0, 1), length_m + 40.0, 60.0)]
    for number, y in enumerate((-2.75, 2.75), start=1):
        outwards = float(np.sign(y))
        surfaces.append(
            rectangle(f"web-{number}-out", (0.0, y + outwards * 0.25, 10.0), (0, outwards, 0), length_m, 2.0)
        )
        surfaces.append(
            rectangle(f"web-{number}-in", (0.0, y - outwards * 0.25, 10.0), (0, -outwards, 0), length_m, 2.0)
        )
        surfaces.append(
            rectangle(f"overhang-{number}", (0.0, outwards * 4.0, 11.0), (0, 0, -1), length_m, 2.0)
        )
        surfaces.append(rectangle(f"flange-{number}", (0.0, y, 9.0), (0, 0, -1), length_m, 0.5))
    surfaces.append(rectangle("soffit", (0.0, 0.0, 11.0), (0, 0, -1), length_m, 5.0))
    extra = [
        points_on(rectangle("deck", (0.0, 0.0, 11.4), (0, 0, 1), length_m, 10.0), SPACING_M),
        *(
            points_on(rectangle("edge", (0.0, y, 11.2), (0, np.sign(y), 0), length_m, 0.4), SPACING_M)
            for y in (-5.0, 5.0)
        ),
    ]
    for number, x in enumerate(np.arange(-half + 15.0, half, 30.0)):
        for side, normal in (("w", (-1, 0, 0)), ("e", (1, 0, 0))):
            surfaces.append(
                rectangle(f"pier-{number}-{side}", (x + 0.6 * normal[0], 0.0, 4.5), normal, 6.0, 9.0)
            )
        for normal in ((0, -1, 0), (0, 1, 0)):
            extra.append(points_on(rectangle("end", (x, 3.0 * normal[1], 4.5), normal, 1.2, 9.0), SPACING_M))
    clouds = [points_on(s, GROUND_SPACING_M if s.name.startswith("ground") else SPACING_M) for s in surfaces]
    points = np.concatenate([*clouds, *extra])
    stations = [
        (float(x), y, 1.7) for x in np.arange(-half, half + 1.0, 15.0) for y in (-14.0, 0.0, 14.0)
    ]  # fmt: skip
    return structure_of(surfaces, points, tuple(stations)), points


def simulated(name: str, seed: int) -> tuple[Structure, Array, tuple[str, ...]]:
    """A scene of the simulator as a perfect scan shows it, and the names of what to inspect: the faces that
    carry cracks, or the three largest that stand or hang."""
    from schemas.inspection import SimulationInput
    from tasks.simulation.scenes import build

    scene = build(SimulationInput.model_validate({"scene": name, "seed": seed}))
    points = np.concatenate([_face_points(face) for face in scene.faces])
    flat = [
        f
        for f in scene.faces
        if f.material in ("concrete", "stone") and not f.name.startswith(scene.curved or "?")
    ]
    seen = sorted(
        (f for f in flat if f.normal[2] < 0.5 and f.name != "ground"), key=lambda f: -f.width_m * f.height_m
    )
    wanted = scene.inspected or tuple(f.name for f in seen[:3])
    surfaces = [f.surface() for f in scene.faces]
    return structure_of(surfaces, points, scene.stations_m), points, wanted


def _face_points(face: Any) -> Array:
    spacing = GROUND_SPACING_M if face.material == "ground" else SPACING_M
    u = np.linspace(0, face.width_m, max(2, int(np.ceil(face.width_m / spacing)) + 1))
    v = np.linspace(0, face.height_m, max(2, int(np.ceil(face.height_m / spacing)) + 1))
    return np.asarray(face.to_world(np.stack(np.meshgrid(u, v), -1).reshape(-1, 2)))


@dataclass(frozen=True)
class Solid:
    """A box, turned clockwise (seen from above) about where the two walls meet."""

    low_m: Array
    high_m: Array
    turned_deg: float = 0.0

    def turn(self, places_m: Array) -> Array:
        c, s = np.cos(np.radians(self.turned_deg)), np.sin(np.radians(self.turned_deg))
        about = places_m - CORNER
        return np.asarray(np.column_stack([about[:, :2] @ [[c, -s], [s, c]], about[:, 2]]) + CORNER)


class Truth:
    """Solids as triangles, and how near a path comes to them: Open3D's exact distance at every centimetre."""

    def __init__(self, solids: list[Solid]) -> None:
        import open3d as o3d

        self._scene = o3d.t.geometry.RaycastingScene()
        for solid in solids:
            mesh = o3d.geometry.TriangleMesh.create_box(*(float(x) for x in solid.high_m - solid.low_m))
            corners = solid.turn(np.asarray(mesh.vertices) + solid.low_m)
            self._scene.add_triangles(
                o3d.core.Tensor(corners.astype(np.float32)),
                o3d.core.Tensor(np.asarray(mesh.triangles).astype(np.uint32)),
            )

    def least_distance_m(self, corners_m: Array) -> float:
        import open3d as o3d

        samples = [
            a + np.linspace(0, 1, max(2, int(np.linalg.norm(b - a) / 0.01)))[:, None] * (b - a)
            for a, b in pairwise(corners_m)
        ]
        places = np.concatenate(samples).astype(np.float32)
        return float(self._scene.compute_distance(o3d.core.Tensor(places)).numpy().min())


def random_scene(seed: int, corner_deg: float = 90.0) -> tuple[Structure, Array, list[Solid]]:
    """Two walls that meet in an inner corner, 8 boxes around them, and all as solids; the ground is not among
    these, since the take-off touches it."""
    rng = np.random.default_rng(seed)
    turned = 90.0 - corner_deg
    solids = [
        Solid(np.array([-4.0, 0.0, 2.0]), np.array([4.0, 0.3, 5.0])),
        Solid(np.array([4.0, -8.0, 2.0]), np.array([4.3, 0.0, 5.0]), turned),
    ]
    middle = solids[1].turn(np.array([[4.0, -4.0, 3.5]]))[0]
    normal = (-np.cos(np.radians(turned)), np.sin(np.radians(turned)), 0.0)
    surfaces = [
        rectangle("ground-01", (0.0, 0.0, 0.0), (0, 0, 1), 30.0, 30.0),
        rectangle("wall-01", (0.0, 0.0, 3.5), (0, -1, 0), 8.0, 3.0),
        rectangle("wall-02", (float(middle[0]), float(middle[1]), 3.5), normal, 8.0, 3.0),
    ]
    while len(solids) < 10:
        low = np.append(rng.uniform(-10, 10, 2), 0.0)
        high = low + np.append(rng.uniform(0.2, 1.0, 2), rng.uniform(2, 9))
        if not (-5.0 < low[0] < 5.0 and -9.0 < low[1] < 1.5):
            solids.append(Solid(low, high))
    clouds = [points_on(s, GROUND_SPACING_M) for s in surfaces]
    clouds += [solid.turn(_box_points(solid.low_m, solid.high_m)) for solid in solids]
    points = np.concatenate(clouds)
    return structure_of(surfaces, points), points, solids


def _box_points(low: Array, high: Array) -> Array:
    ticks = [
        np.linspace(a, b, max(2, int(np.ceil((b - a) / SPACING_M)) + 1))
        for a, b in zip(low, high, strict=True)
    ]
    faces = []
    for axis in range(3):
        for end in (low[axis], high[axis]):
            sides = [np.array([end]) if k == axis else ticks[k] for k in range(3)]
            faces.append(np.stack(np.meshgrid(*sides), -1).reshape(-1, 3))
    return np.concatenate(faces)


def small_plan() -> FlightPlan:
    """A wall of 3 × 2 m, photographed."""
    from tasks.planning.plan import plan_and_prove

    ground = rectangle("ground-01", (0.0, 0.0, 0.0), (0, 0, 1), 20.0, 20.0)
    wall = rectangle("wall-01", (0.0, 0.0, 4.0), (0, -1, 0), 3.0, 2.0)
    points = np.concatenate([points_on(ground, GROUND_SPACING_M), points_on(wall, SPACING_M)])
    camera = Camera(width_px=1632, height_px=1224, focal_px=4000.0)
    origin = GeoOrigin(latitude_deg=47.1234567, longitude_deg=8.7654321, altitude_m=412.0)
    settings = PlanSettings(gsd_mm_px=1.2, overlap=0.3, free_m=(OPEN,))
    structure = structure_of([ground, wall], points)
    return plan_and_prove(structure, points, camera, Vehicle(), origin, None, settings)[0]
