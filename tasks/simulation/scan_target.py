"""What a scanner's rays meet: the scene as triangles, its ground uneven."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.ndimage import gaussian_filter

from tasks.simulation.face import Array, Face

GROUND_RELIEF_M = 0.04
GROUND_CELL_M = 1.0
NOTHING, MIXED = -1, -2  # in place of a face's index

Indices = npt.NDArray[np.int32]


@dataclass(frozen=True)
class Hits:
    """Of N rays: distance_m (inf: none), face (its index, NOTHING or MIXED), slant (cosine of incidence)."""

    distance_m: Array
    face: Indices
    slant: Array


class ScanTarget:
    def __init__(self, faces: Sequence[Face], seed: int) -> None:
        import open3d as o3d  # takes seconds to import

        flat = [k for k, f in enumerate(faces) if f.material != "ground"]
        reliefs = {k: _relief(f, seed) for k, f in enumerate(faces) if f.material == "ground"}
        corners = [faces[k].corners_m[[[0, 1, 2], [0, 2, 3]]] for k in flat]
        triangles = np.concatenate([*corners, *reliefs.values()])
        self._face_of = np.concatenate(
            [np.repeat(flat, 2), *(np.full(len(relief), k) for k, relief in reliefs.items())]
        ).astype(np.int32)
        self._tensor = o3d.core.Tensor.from_numpy
        self._caster = o3d.t.geometry.RaycastingScene(nthreads=1)
        vertices = triangles.reshape(-1, 3).astype(np.float32)
        indices = np.arange(len(vertices), dtype=np.uint32).reshape(-1, 3)
        self._caster.add_triangles(self._tensor(vertices), self._tensor(indices))

    def cast(self, origin_m: npt.ArrayLike, directions: Array) -> Hits:
        """First hits of rays in (N, 3) unit directions."""
        rays = np.hstack([np.broadcast_to(np.asarray(origin_m, dtype=float), directions.shape), directions])
        rays = rays.astype(np.float32)
        answer = self._caster.cast_rays(self._tensor(rays))
        distance_m = answer["t_hit"].numpy().astype(float)
        hit = np.isfinite(distance_m)
        face = np.full(len(rays), NOTHING, dtype=np.int32)
        face[hit] = self._face_of[answer["primitive_ids"].numpy()[hit]]
        slant = np.abs(np.einsum("ni,ni->n", answer["primitive_normals"].numpy(), rays[:, 3:]))
        return Hits(distance_m, face, slant.astype(float))


def _relief(ground: Face, seed: int) -> Array:
    """(N, 3, 3) triangles of uneven ground."""
    rng = np.random.default_rng([seed, 0x47726E64])
    columns, rows = (round(side / GROUND_CELL_M) + 1 for side in (ground.width_m, ground.height_m))
    bumps = gaussian_filter(rng.standard_normal((rows, columns)), 1.5)
    v, u = np.mgrid[:rows, :columns] * GROUND_CELL_M
    points = ground.to_world(np.column_stack([u.ravel(), v.ravel()]))
    points += np.outer(bumps.ravel() / bumps.std() * GROUND_RELIEF_M, ground.normal)
    grid = points.reshape(rows, columns, 3)
    a, b, c, d = grid[:-1, :-1], grid[:-1, 1:], grid[1:, 1:], grid[1:, :-1]
    lower = np.stack([a, b, c], axis=2).reshape(-1, 3, 3)
    upper = np.stack([a, c, d], axis=2).reshape(-1, 3, 3)
    return np.concatenate([lower, upper])
