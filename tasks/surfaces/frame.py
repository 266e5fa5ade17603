"""A plane's own coordinates."""

from dataclasses import dataclass

import numpy as np

from schemas.contract import Vector3
from schemas.surface import Surface, in_plane_axes
from tasks.surfaces.cloud import Floats


@dataclass(frozen=True)
class Frame:
    """origin (3,) on the plane; axes (3, 3) with columns u, v, normal as schemas.surface has them."""

    origin: Floats
    axes: Floats

    @classmethod
    def on(cls, origin: Floats, normal: Floats) -> "Frame":
        u, v = in_plane_axes(normal)
        return cls(origin, np.column_stack([u, v, normal]))

    @classmethod
    def of(cls, surface: Surface) -> "Frame":
        return cls(np.asarray(surface.origin_m), surface.R_world_surface)

    @property
    def normal(self) -> Floats:
        return self.axes[:, 2]

    def uvw_m(self, points_m: Floats) -> Floats:
        """(N, 3) u, v in the plane and w above it of (N, 3) points. einsum: BLAS may sum in another order
        on another number of threads."""
        return np.asarray(np.einsum("ni,ij->nj", points_m - self.origin, self.axes))

    def world_m(self, uv_m: Floats) -> Floats:
        """(N, 3) points of (N, 2) in-plane coordinates."""
        return np.asarray(self.origin + np.einsum("nj,ij->ni", uv_m, self.axes[:, :2]))


def vector3(values: Floats) -> Vector3:
    return float(values[0]), float(values[1]), float(values[2])
