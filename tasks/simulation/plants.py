"""Leaves: small squares that face anywhere."""

import numpy as np

from schemas.contract import Vector3
from tasks.simulation.face import Face, Placement

LEAF_M = 0.22


def crown(
    place: Placement, rng: np.random.Generator, middle_m: Vector3, radius_m: float = 1.5, leaves: int = 260
) -> tuple[Face, ...]:
    """A tree's crown, or a bush: leaves within a ball, given in the structure's own frame."""
    faces = []
    for k in range(leaves):
        direction = rng.standard_normal(3)
        centre = np.asarray(middle_m) + radius_m * rng.uniform(0.3, 1.0) * direction / np.linalg.norm(
            direction
        )
        u = rng.standard_normal(3)
        u /= np.linalg.norm(u)
        v = np.cross(u, rng.standard_normal(3))
        v /= np.linalg.norm(v)
        corner = centre - LEAF_M / 2 * (u + v)
        faces.append(place.face(f"leaf-{k}", corner, u, v, LEAF_M, LEAF_M, "leaf"))
    return tuple(faces)
