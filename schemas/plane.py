"""The paper's plane M = [a, b, c, d] with a unit normal."""

import math
from typing import Self

import numpy as np
import numpy.typing as npt
from pydantic import model_validator

from schemas.contract import Contract, Vector3

Points = npt.NDArray[np.float64]  # (N, 3), metres


class Plane(Contract):
    """a·x + b·y + c·z + d = 0, ‖(a, b, c)‖ = 1, metres (paper, section 2.2)."""

    normal: Vector3
    d_m: float

    @model_validator(mode="after")
    def _unit_normal(self) -> Self:
        if not math.isclose(math.hypot(*self.normal), 1.0, abs_tol=1e-6):
            raise ValueError(f"plane normal {self.normal} is not of unit length")
        return self

    @classmethod
    def through(cls, point_m: npt.ArrayLike, normal: npt.ArrayLike) -> Self:
        n = np.asarray(normal, dtype=float)
        n = n / np.linalg.norm(n)
        return cls(normal=(float(n[0]), float(n[1]), float(n[2])), d_m=float(-n @ np.asarray(point_m)))

    def signed_distance_m(self, points_m: npt.ArrayLike) -> npt.NDArray[np.float64]:
        """(N,) signed distances of (N, 3) points; positive on the normal's side."""
        return np.asarray(np.asarray(points_m, dtype=float) @ np.asarray(self.normal) + self.d_m)
