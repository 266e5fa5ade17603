"""A small bridge, made up by hand: its surfaces, its registered cloud and a flight about it."""

import hashlib
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path

import numpy as np

from schemas.camera import Camera
from schemas.file import File
from schemas.flight_log import FlightLog, Shot, TrackError, TrackPoint
from schemas.flight_plan import FlightPlan, SurfaceCoverage, Waypoint
from schemas.geodesy import GeoOrigin
from schemas.obstacle import Obstacle
from schemas.plane import Plane
from schemas.registered_model import RegisteredModel, ScanPair, Station
from schemas.structure import Structure
from schemas.surface import Surface, in_plane_axes
from schemas.vehicle import Vehicle

CAMERA = Camera(width_px=1632, height_px=1224, focal_px=4000)
BACK_M = np.array([0.0, -1.0, 0.5])


@dataclass
class Shelf:
    """Files by their digest, as the store keeps them."""

    folder: Path
    paths: dict[File, Path] = field(default_factory=dict)

    def put(self, path: Path) -> File:
        content = path.read_bytes()
        file = File(sha256=hashlib.sha256(content).hexdigest(), size=len(content), suffix=path.suffix)
        self.paths[file] = path
        return file

    def open_file(self, file: File) -> Path:
        return self.paths[file]


def surface(name, middle_m, normal, width_m, height_m, notch=False):
    u, v = in_plane_axes(normal)
    w, h = width_m / 2, height_m / 2
    outline = [(-w, -h), (w, -h), (w, h), (-w, h)]
    if notch:
        outline = [
            (-w, -h),
            (w, -h),
            (w, h),
            (w * 0.55, h),
            (w * 0.55, h * 0.45),
            (w * 0.2, h * 0.45),
            (w * 0.2, h),
            (-w, h),
        ]
    return Surface(
        name=name,
        plane=Plane.through(middle_m, normal),
        origin_m=middle_m,
        u=u,
        v=v,
        outline_m=tuple(outline),
        hull_m=((-w, -h), (w, -h), (w, h), (-w, h)),
        area_m2=width_m * height_m,
        rms_m=0.004,
        points=1000,
    )


def structure(shelf: Shelf) -> Structure:
    surfaces = [
        surface("ground-01", (0, 0, 0), (0, 0, 1), 24, 18),
        surface("wall-01", (0, -3, 7.4), (0, -1, 0), 12, 0.9),
        surface("wall-02", (0, 3, 7.4), (0, 1, 0), 12, 0.9),
        surface("soffit-01", (0, -1.6, 6.9), (0, 0, -1), 11, 1.2),
        surface("soffit-02", (0, 1.6, 6.9), (0, 0, -1), 11, 1.2),
        surface("top-01", (0, 0, 8.1), (0, 0, 1), 12, 6),
    ]
    for index, x in enumerate((-5.4, 5.4)):
        surfaces += [
            surface(f"wall-1{index}", (x, -1.4, 3.4), (0, -1, 0), 1.6, 6.0, notch=index == 0),
            surface(f"wall-2{index}", (x + 0.8, 0, 3.4), (1, 0, 0), 2.8, 6.0),
            surface(f"wall-3{index}", (x - 0.8, 0, 3.4), (-1, 0, 0), 2.8, 6.0),
        ]
    tree = np.random.default_rng(3).normal(size=(60, 3))
    tree = tree / np.linalg.norm(tree, axis=1)[:, None] * (1.1, 1.1, 1.7) + (8.6, -5.5, 2.4)
    pole = [(x, y, z) for x in (-8.1, -7.95) for y in (-5.1, -4.95) for z in (0, 6.5)]
    cloud = shelf.folder / "occupied.ply"
    write_ply(cloud, np.zeros((1, 3)), np.zeros(1))
    return Structure(
        surfaces=tuple(surfaces),
        obstacles=tuple(
            Obstacle(
                name=name,
                points=60,
                min_m=tuple(p.min(axis=0)),
                max_m=tuple(p.max(axis=0)),
                hull_m=tuple(map(tuple, p)),
            )
            for name, p in (("obstacle-01", tree), ("obstacle-02", np.array(pole)))
        ),
        occupied=shelf.put(cloud),
        min_m=(-12, -9, 0),
        max_m=(12, 9, 8.1),
    )


def write_ply(path: Path, points_m, stations) -> None:
    names = ("x", "y", "z", "nx", "ny", "nz")
    table = np.zeros(len(points_m), dtype=[(n, "<f4") for n in names] + [("station", "u1")])
    for axis in range(3):
        table[names[axis]] = points_m[:, axis]
    table["station"] = stations
    header = f"ply\nformat binary_little_endian 1.0\ncomment metres\nelement vertex {len(table)}\n"
    header += "".join(f"property float {n}\n" for n in names) + "property uchar station\nend_header\n"
    path.write_bytes(header.encode() + table.tobytes())


def model(shelf: Shelf, built: Structure) -> RegisteredModel:
    rng = np.random.default_rng(1)
    points = np.vstack(
        [
            s.to_world(rng.uniform(s.bounds_m[:2], s.bounds_m[2:], (int(250 * s.area_m2), 2)))
            + rng.normal(0, 0.003, (int(250 * s.area_m2), 3))
            for s in built.surfaces
        ]
    )
    places = [(-9.0, -8.0, 1.6), (9.0, -8.0, 1.6), (9.0, 8.0, 1.6), (-9.0, 8.0, 1.6)]
    nearest = np.argmin(
        np.linalg.norm(points[:, None] - np.array(places), axis=2) + rng.normal(0, 2, (len(points), 4)),
        axis=1,
    )
    path = shelf.folder / "model.ply"
    write_ply(path, points, nearest)
    stations = tuple(
        Station(
            name=f"station-{i + 1}.ply",
            T_world_scan=(
                (1.0, 0.0, 0.0, p[0]),
                (0.0, 1.0, 0.0, p[1]),
                (0.0, 0.0, 1.0, p[2]),
                (0.0, 0.0, 0.0, 1.0),
            ),
            points=int((nearest == i).sum()),
        )
        for i, p in enumerate(places)
    )
    pairs = tuple(
        ScanPair(
            source=stations[a].name,
            target=stations[b].name,
            T_target_source=stations[0].T_world_scan,
            overlap=0.62 - 0.05 * a,
            rmse_m=0.0031 + 0.0002 * a,
            inliers=9000 - 300 * b,
        )
        for a, b in ((1, 0), (2, 1), (3, 2), (0, 3))
    )
    return RegisteredModel(
        cloud=shelf.put(path),
        stations=stations,
        pairs=pairs,
        points=len(points),
        min_m=(-12, -9, 0),
        max_m=(12, 9, 8.1),
    )


def flight(
    shelf: Shelf, built: Structure, names=("wall-01", "wall-10", "soffit-01")
) -> tuple[FlightPlan, FlightLog]:
    waypoints: list[Waypoint] = []
    for one in (s for name in names for s in built.surfaces if s.name == name):
        normal = np.array(one.plane.normal)
        yaw = float(np.degrees(np.arctan2(-normal[0], -normal[1])) % 360) if abs(normal[2]) < 0.5 else 0.0
        u0, v0, u1, v1 = one.bounds_m
        grid = [(u, v) for v in np.arange(v0 + 0.4, v1, 0.6) for u in np.arange(u0 + 0.5, u1, 0.8)]
        for n, uv in enumerate(grid):
            position = one.to_world([(*uv, 4.0)])[0]
            if n == 0:
                waypoints.append(
                    Waypoint(kind="intermediate", position_m=tuple(position + BACK_M), yaw_deg=yaw)
                )
            waypoints.append(
                Waypoint(
                    kind="shooting",
                    position_m=tuple(position),
                    yaw_deg=yaw,
                    surface=one.name,
                    pitch_deg=float(np.degrees(np.arcsin(-normal[2]))),
                    photo=f"{one.name}-{n + 1:03d}",
                )
            )
    plan = FlightPlan(
        camera=CAMERA,
        vehicle=Vehicle(),
        origin=GeoOrigin(latitude_deg=-33.9, longitude_deg=151.2),
        home_m=(-9, -8, 0.0),
        waypoints=tuple(waypoints),
        coverage=tuple(
            SurfaceCoverage(
                surface=name,
                area_m2=10.8,
                covered=0.987,
                stand_off_m=4.0,
                gsd_mm_px=1.0,
                photos=30,
                not_reached=("behind the pier for 0.3 m",) if name == "soffit-01" else (),
            )
            for name in names
        ),
        length_m=142.3,
        duration_s=371.0,
        overlap=0.63,
    )
    rng = np.random.default_rng(5)
    corners = np.array([plan.home_m, *(w.position_m for w in waypoints), plan.home_m])
    dense = np.vstack([np.linspace(a, b, 6)[:-1] for a, b in pairwise(corners)])
    walk = np.cumsum(rng.normal(0, 0.02, dense.shape), axis=0)
    flown = dense + 0.3 * np.tanh(walk)
    archive = shelf.folder / "flight.mcap"
    archive.write_bytes(b"\x89MCAP0\r\n")
    log = FlightLog(
        archive=shelf.put(archive),
        vehicle="simulated",
        duration_s=384.0,
        track=tuple(
            TrackPoint(time_s=0.5 * i, position_m=tuple(p), yaw_deg=0.0) for i, p in enumerate(flown)
        ),
        shots=tuple(
            Shot(photo=w.photo, surface=w.surface, time_s=2.0, pose=w.pose) for w in plan.shooting_points[:-1]
        ),
        errors=(
            TrackError(what="flight", rms_m=0.21, largest_m=0.48),
            *(TrackError(what=name, rms_m=0.17 + 0.02 * i, largest_m=0.36) for i, name in enumerate(names)),
            *(TrackError(what=f"leg {i}", rms_m=0.1 + 0.005 * i, largest_m=0.3) for i in range(1, 25)),
        ),
        missed=(plan.shooting_points[-1].photo,),
    )
    return plan, log
