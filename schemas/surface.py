"""A flat surface to inspect, with its own in-plane frame."""

import numpy as np
import numpy.typing as npt

from schemas.contract import Contract, Vector2, Vector3
from schemas.plane import Plane

Array = npt.NDArray[np.float64]


class Surface(Contract):
    """A plane patch. Seen from the side to inspect from, `u` points right, `v` up, the normal at the
    viewer: (u, v, normal) is right-handed. Horizontal surfaces take `v` from world north (y).

    In-plane coordinates (u, v) are metres from `origin_m`; the third, w, is metres along the normal.
    """

    name: str  # by kind, facing and place, "wall-south-03", "soffit-01": tasks/surfaces/naming.py
    plane: Plane  # its normal points to the side to inspect from
    origin_m: Vector3  # world position of (u, v) = (0, 0), on the plane
    u: Vector3
    v: Vector3
    outline_m: tuple[Vector2, ...]  # concave outer ring, counter-clockwise, not repeated at its end
    holes_m: tuple[tuple[Vector2, ...], ...] = ()
    hull_m: tuple[Vector2, ...]  # convex hull (paper)
    area_m2: float  # of the outline less its holes
    rms_m: float = 0.0  # of the supporting points about the plane
    deviation_m: float = 0.0  # 95 % of its points lie within this of the plane: how flat it is
    points: int = 0

    @property
    def R_world_surface(self) -> Array:
        """(3, 3): columns u, v, normal."""
        return np.column_stack([self.u, self.v, self.plane.normal])

    def to_world(self, uvw_m: npt.ArrayLike) -> Array:
        """(N, 3) world metres from (N, 2) or (N, 3) surface coordinates."""
        uvw = np.atleast_2d(np.asarray(uvw_m, dtype=float))
        if uvw.shape[1] == 2:
            uvw = np.column_stack([uvw, np.zeros(len(uvw))])
        return np.asarray(uvw @ self.R_world_surface.T + np.asarray(self.origin_m))

    def to_surface(self, points_m: npt.ArrayLike) -> Array:
        """(N, 3) surface coordinates (u, v, w) of (N, 3) world points."""
        points = np.atleast_2d(np.asarray(points_m, dtype=float))
        return np.asarray((points - np.asarray(self.origin_m)) @ self.R_world_surface)

    @property
    def bounds_m(self) -> tuple[float, float, float, float]:
        """u_min, v_min, u_max, v_max of the outline."""
        uv = np.asarray(self.outline_m)
        return (float(uv[:, 0].min()), float(uv[:, 1].min()), float(uv[:, 0].max()), float(uv[:, 1].max()))


def in_plane_axes(normal: npt.ArrayLike) -> tuple[Vector3, Vector3]:
    """The stable (u, v) of a surface with this unit normal: v is world up laid into the plane, or world
    north where the surface is within 25° of horizontal."""
    n = np.asarray(normal, dtype=float)
    reference = np.array([0.0, 1.0, 0.0]) if abs(n[2]) > np.cos(np.radians(25)) else np.array([0.0, 0.0, 1.0])
    v = reference - n * (reference @ n)
    v /= np.linalg.norm(v)
    u = np.cross(v, n)
    return (float(u[0]), float(u[1]), float(u[2])), (float(v[0]), float(v[1]), float(v[2]))
