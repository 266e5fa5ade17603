"""The simulated world is made of faces: flat rectangles, each with a frame of its own."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

from schemas.contract import Vector3
from schemas.plane import Plane
from schemas.surface import Surface, in_plane_axes

Array = npt.NDArray[np.float64]
Material = Literal["concrete", "wood", "ground", "metal", "leaf", "glass"]


@dataclass(frozen=True)
class Face:
    """A rectangle [0, width] × [0, height] in metres of the frame (u, v, normal) at `origin_m`.

    (u, v, normal) is right-handed and the normal points to the outside. The frame follows the edges;
    `surface()` gives the same rectangle in the convention of schemas.surface.
    """

    name: str
    origin_m: Vector3
    u: Vector3
    v: Vector3
    width_m: float
    height_m: float
    material: Material = "concrete"

    @property
    def normal(self) -> Array:
        return np.cross(self.u, self.v)

    @property
    def R_world_face(self) -> Array:
        """(3, 3): columns u, v, normal."""
        return np.column_stack([self.u, self.v, self.normal])

    def to_world(self, uv_m: npt.ArrayLike) -> Array:
        """(N, 3) world metres of (N, 2) face coordinates."""
        uv = np.atleast_2d(np.asarray(uv_m, dtype=float))
        return np.asarray(uv @ np.array([self.u, self.v]) + np.asarray(self.origin_m))

    def to_face(self, points_m: npt.ArrayLike) -> Array:
        """(N, 3) face coordinates (u, v, w) of (N, 3) world points."""
        points = np.atleast_2d(np.asarray(points_m, dtype=float))
        return np.asarray((points - np.asarray(self.origin_m)) @ self.R_world_face)

    @property
    def corners_m(self) -> Array:
        """(4, 3), counter-clockwise seen from outside."""
        w, h = self.width_m, self.height_m
        return self.to_world([(0, 0), (w, 0), (w, h), (0, h)])

    def surface(self) -> Surface:
        normal = self.normal
        u, v = in_plane_axes(normal)
        centre = self.to_world([(self.width_m / 2, self.height_m / 2)])[0]
        outline = (self.corners_m - centre) @ np.column_stack([u, v])
        ring = tuple((float(a), float(b)) for a, b in outline)
        return Surface(
            name=self.name,
            plane=Plane.through(centre, normal),
            origin_m=vector(centre),
            u=u,
            v=v,
            outline_m=ring,
            hull_m=ring,
            area_m2=self.width_m * self.height_m,
        )


@dataclass(frozen=True)
class FaceArrays:
    """The same faces as arrays, for ray casting: N faces."""

    origin: Array  # (N, 3)
    u: Array  # (N, 3)
    v: Array  # (N, 3)
    normal: Array  # (N, 3)
    size: Array  # (N, 2)

    @classmethod
    def of(cls, faces: tuple[Face, ...]) -> "FaceArrays":
        return cls(
            origin=np.array([f.origin_m for f in faces], dtype=float),
            u=np.array([f.u for f in faces], dtype=float),
            v=np.array([f.v for f in faces], dtype=float),
            normal=np.array([f.normal for f in faces], dtype=float),
            size=np.array([(f.width_m, f.height_m) for f in faces], dtype=float),
        )

    def __getitem__(self, keep: npt.NDArray[np.int64]) -> "FaceArrays":
        return FaceArrays(self.origin[keep], self.u[keep], self.v[keep], self.normal[keep], self.size[keep])


@dataclass(frozen=True)
class Placement:
    """Where a structure stands in the world: turned about the vertical, then moved."""

    yaw_deg: float = 0.0  # counter-clockwise seen from above
    offset_m: Vector3 = (0.0, 0.0, 0.0)

    @property
    def R(self) -> Array:
        c, s = np.cos(np.radians(self.yaw_deg)), np.sin(np.radians(self.yaw_deg))
        return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])

    def point(self, local_m: npt.ArrayLike) -> Vector3:
        return vector(self.R @ np.asarray(local_m, dtype=float) + self.offset_m)

    def face(
        self,
        name: str,
        origin_m: npt.ArrayLike,
        u: npt.ArrayLike,
        v: npt.ArrayLike,
        width_m: float,
        height_m: float,
        material: Material = "concrete",
    ) -> Face:
        """A face given in the structure's own frame."""
        return Face(
            name,
            self.point(origin_m),
            vector(self.R @ np.asarray(u, dtype=float)),
            vector(self.R @ np.asarray(v, dtype=float)),
            width_m,
            height_m,
            material,
        )

    def box(
        self,
        name: str,
        low_m: Vector3,
        high_m: Vector3,
        sides: str = "wesntb",
        material: Material = "concrete",
    ) -> tuple[Face, ...]:
        """The faces of a box. sides: west, east, south, north, top, bottom of the structure's own frame."""
        (x0, y0, z0), (x1, y1, z1) = low_m, high_m
        dx, dy, dz = x1 - x0, y1 - y0, z1 - z0
        x, y, z = np.eye(3)
        all_sides = {
            "s": ((x0, y0, z0), x, z, dx, dz),
            "n": ((x1, y1, z0), -x, z, dx, dz),
            "w": ((x0, y1, z0), -y, z, dy, dz),
            "e": ((x1, y0, z0), y, z, dy, dz),
            "t": ((x0, y0, z1), x, y, dx, dy),
            "b": ((x1, y0, z0), -x, y, dx, dy),
        }
        words = {"s": "south", "n": "north", "w": "west", "e": "east", "t": "top", "b": "bottom"}
        return tuple(
            self.face(f"{name}-{words[side]}", *all_sides[side], material=material) for side in sides
        )


def vector(values: npt.ArrayLike) -> Vector3:
    x, y, z = np.asarray(values, dtype=float)
    return float(x), float(y), float(z)
