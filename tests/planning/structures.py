"""Small structures with known truth: rectangles, their points every 10 cm, and nothing else."""

from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from schemas.box import Box
from schemas.camera import Camera
from schemas.contract import Vector3
from schemas.file import File
from schemas.geodesy import GeoOrigin
from schemas.plane import Plane
from schemas.structure import Structure
from schemas.surface import Surface, in_plane_axes
from schemas.vehicle import Vehicle

Array = npt.NDArray[np.float64]

CAMERA = Camera(width_px=1632, height_px=1224, focal_px=4000.0)  # 1 mm/px at 4 m, 1.63 × 1.22 m
VEHICLE = Vehicle(position_bias_m=0.1, position_jitter_m=0.03)
ORIGIN = GeoOrigin(latitude_deg=50.0, longitude_deg=10.0, altitude_m=300.0)
SPACING_M = 0.1
OPEN = Box(low_m=(-200.0, -200.0, -20.0), high_m=(200.0, 200.0, 150.0))  # air that somebody vouches for


def rectangle(
    name: str,
    middle_m: tuple[float, float, float],
    normal: tuple[float, float, float],
    width: float,
    height: float,
) -> Surface:
    """A surface `width` along u and `height` along v, its middle at `middle_m`."""
    n = np.asarray(normal) / np.linalg.norm(normal)
    u, v = in_plane_axes(n)
    a, b = width / 2, height / 2
    outline = ((-a, -b), (a, -b), (a, b), (-a, b))
    return Surface(
        name=name, plane=Plane.through(middle_m, n), origin_m=middle_m, u=u, v=v,
        outline_m=outline, hull_m=outline, area_m2=width * height,
    )  # fmt: skip


def points_on(surface: Surface, spacing_m: float = SPACING_M) -> Array:
    """(N, 3) points of a rectangle every `spacing_m`, its border included."""
    u_low, v_low, u_high, v_high = surface.bounds_m
    u = np.linspace(u_low, u_high, max(2, round((u_high - u_low) / spacing_m) + 1))
    v = np.linspace(v_low, v_high, max(2, round((v_high - v_low) / spacing_m) + 1))
    return surface.to_world(np.stack(np.meshgrid(u, v), -1).reshape(-1, 2))


def box(low: Vector3, high: Vector3) -> Array:
    """(N, 3) points every 10 cm on the faces of a box."""
    ticks = [
        np.linspace(a, b, max(2, round((b - a) / SPACING_M) + 1)) for a, b in zip(low, high, strict=True)
    ]
    faces = []
    for axis in range(3):
        for end in (low[axis], high[axis]):
            sides = [np.array([end]) if k == axis else ticks[k] for k in range(3)]
            faces.append(np.stack(np.meshgrid(*sides), -1).reshape(-1, 3))
    return np.unique(np.concatenate(faces).round(6), axis=0)


@dataclass
class World:
    surfaces: list[Surface] = field(default_factory=list)
    points: list[Array] = field(default_factory=list)

    def add(self, surface: Surface) -> "World":
        self.surfaces.append(surface)
        self.points.append(points_on(surface))
        return self

    def add_points(self, points: Array) -> "World":
        self.points.append(points)
        return self

    @property
    def cloud(self) -> Array:
        return np.concatenate(self.points)

    @property
    def structure(self) -> Structure:
        low, high = self.cloud.min(axis=0), self.cloud.max(axis=0)
        return Structure(
            surfaces=tuple(self.surfaces), obstacles=(),
            occupied=File(sha256="0" * 64, size=0, suffix=".ply"),
            min_m=tuple(low.tolist()), max_m=tuple(high.tolist()),
        )  # fmt: skip


def wall(width: float = 6.0, height: float = 4.0, bottom: float = 3.0) -> World:
    """A wall that faces south, above flat ground."""
    return (
        World()
        .add(rectangle("ground-01", (0.0, 0.0, 0.0), (0, 0, 1), 32.0, 32.0))
        .add(rectangle("wall-01", (0.0, 0.0, bottom + height / 2), (0, -1, 0), width, height))
    )


def bridge() -> World:
    """The demo's bridge in rectangles: a span of 12 m along x, a soffit 6.5 m up between two girders that
    hang 0.9 m below it, two piers, ground."""
    world = World().add(rectangle("ground-01", (0.0, 0.0, 0.0), (0, 0, 1), 40.0, 40.0))
    world.add(rectangle("soffit-01", (0.0, 0.0, 7.4), (0, 0, -1), 11.0, 1.2))
    for side, y in ((-1, -0.6), (1, 0.6)):
        world.add(rectangle(f"web-{1 + (side > 0):02d}", (0.0, side * 1.0, 6.95), (0, side, 0), 12.0, 0.9))
        world.add(rectangle(f"web-{3 + (side > 0):02d}", (0.0, y, 6.95), (0, -side, 0), 12.0, 0.9))
        world.add(rectangle(f"flange-{1 + (side > 0):02d}", (0.0, side * 0.8, 6.5), (0, 0, -1), 12.0, 0.4))
    for k, x in ((1, -6.0), (2, 6.0)):
        side = float(np.sign(-x))
        world.add(rectangle(f"pier-{k:02d}", (x, 0.0, 3.1), (side, 0, 0), 1.6, 5.0))
        world.add(rectangle(f"pier-{k + 2:02d}", (x - side, 0.0, 3.1), (-side, 0, 0), 1.6, 5.0))
        world.add_points(box((min(x, x - side), -0.8, 0.0), (max(x, x - side), 0.8, 6.5)))
    return world.add_points(box((-6.5, -1.5, 7.4), (6.5, 1.5, 7.7)))
