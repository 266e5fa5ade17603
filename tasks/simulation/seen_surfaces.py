"""The flat surfaces and curved parts of a scene that its scanners truly see: what extraction is judged by."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import shapely
from scipy import ndimage

from schemas.plane import Plane
from schemas.surface import Surface, in_plane_axes
from tasks.simulation.face import Array, Face, vector
from tasks.simulation.scan_target import ScanTarget
from tasks.simulation.scene import Scene

PIXEL_M = 0.04
BRIDGED_M = 0.12  # a shadow no wider parts no surface
SAME_PLANE_M, SAME_COSINE = 0.001, float(np.cos(np.radians(0.05)))
LIFT_M = 0.002  # of a place before its wall, so that the wall itself does not hide it


@dataclass(frozen=True)
class CurvedPart:
    """points_m: (N, 3) places on it, a pixel of area_m2 / N each; normals: (N, 3) out of the structure."""

    name: str
    points_m: Array
    normals: Array
    area_m2: float


def seen_surfaces(
    scene: Scene, step_deg: float, widest_gap_m: float, narrowest_m: float = 0.0, glass: bool = False
) -> tuple[Surface, ...]:
    """Flat pieces that rays of some station meet at most `widest_gap_m` apart, coplanar neighbours joined,
    what is narrower than `narrowest_m` cut off, with their holes; named after the largest face. No ground, no
    leaves, and no panes unless `glass`. step_deg: between neighbouring rays."""
    target = ScanTarget(scene.faces, scene.seed)
    left_out = ("ground",) if glass else ("ground", "glass")
    flat = [
        f
        for f in scene.faces
        if f.material not in left_out and not f.name.startswith("leaf-") and not _part(f, scene)
    ]
    sight = _Sight(scene, target, step_deg, widest_gap_m)
    return tuple(piece for faces in _by_plane(flat) for piece in _pieces(faces, sight, narrowest_m))


def curved_parts(scene: Scene, step_deg: float, widest_gap_m: float) -> tuple[CurvedPart, ...]:
    """Of each curved part what a station sees, likewise."""
    sight = _Sight(scene, ScanTarget(scene.faces, scene.seed), step_deg, widest_gap_m)
    parts = []
    for name in scene.curved:
        points, normals = [], []
        for face in (f for f in scene.faces if _part(f, scene) == name):
            columns, rows = (max(round(side / PIXEL_M), 1) for side in (face.width_m, face.height_m))
            v, u = np.mgrid[:rows, :columns]
            uv = np.column_stack(
                [(u.ravel() + 0.5) * face.width_m / columns, (v.ravel() + 0.5) * face.height_m / rows]
            )
            points.append(face.to_world(uv))
            normals.append(np.broadcast_to(face.normal, (len(uv), 3)))
        places, outward = np.concatenate(points), np.concatenate(normals)
        seen = sight.of(places, outward)
        parts.append(CurvedPart(name, places[seen], outward[seen], float(seen.sum()) * PIXEL_M**2))
    return tuple(parts)


def _part(face: Face, scene: Scene) -> str | None:
    part = face.name.rpartition("-")[0]
    return part if part in scene.curved else None


def _by_plane(faces: Iterable[Face]) -> list[list[Face]]:
    groups: list[tuple[Array, float, list[Face]]] = []
    for face in faces:
        offset = float(face.normal @ face.origin_m)
        for normal, d, members in groups:
            if normal @ face.normal > SAME_COSINE and abs(d - offset) < SAME_PLANE_M:
                members.append(face)
                break
        else:
            groups.append((face.normal, offset, [face]))
    return [members for _, _, members in groups]


def _pieces(faces: Sequence[Face], sight: "_Sight", narrowest_m: float) -> list[Surface]:
    """The connected seen pieces on one plane."""
    normal, origin = faces[0].normal, np.asarray(faces[0].origin_m)
    u, v = in_plane_axes(normal)
    axes = np.column_stack([u, v])
    rings = [(f.corners_m - origin) @ axes for f in faces]
    corner = np.concatenate(rings).min(axis=0) - PIXEL_M
    columns, rows = np.ceil((np.concatenate(rings).max(axis=0) + PIXEL_M - corner) / PIXEL_M).astype(int)
    j, i = np.mgrid[:rows, :columns]
    uv = corner + (np.column_stack([i.ravel(), j.ravel()]) + 0.5) * PIXEL_M
    owner = np.full(len(uv), -1)
    for number, ring in enumerate(rings):
        owner[shapely.intersects_xy(shapely.Polygon(ring), uv[:, 0], uv[:, 1])] = number
    of_face = np.flatnonzero(owner >= 0)
    places = origin + uv[of_face] @ axes.T
    mask = np.zeros(len(uv), dtype=bool)
    mask[of_face] = sight.of(places, np.broadcast_to(normal, places.shape))
    seen = mask.reshape(rows, columns)
    disc = np.hypot(*np.mgrid[-2:3, -2:3]) * PIXEL_M <= BRIDGED_M / 2 + 1e-9
    closed = ndimage.binary_closing(np.pad(seen, 3), disc)[3:-3, 3:-3] & (owner >= 0).reshape(rows, columns)
    wide = round(narrowest_m / PIXEL_M)
    if wide > 1:
        closed = ndimage.binary_opening(closed, np.ones((wide, wide)))
    labels, count = ndimage.label(closed)
    found = []
    for label in range(1, count + 1):
        own = labels == label
        most = int(np.bincount(owner.reshape(rows, columns)[own]).argmax())
        boxes = [
            shapely.box(
                *(corner + (c, r) * np.array(PIXEL_M)), *(corner + np.array((c + 1, r + 1)) * PIXEL_M)
            )
            for r, c in zip(*np.nonzero(own), strict=True)
        ]
        found.append(_surface(faces[most].name, shapely.union_all(boxes), origin, normal, axes))
    return found


def _surface(name: str, shape: shapely.Geometry, origin: Array, normal: Array, axes: Array) -> Surface:
    polygon = max(shapely.get_parts(shape), key=lambda part: part.area)
    polygon = shapely.orient_polygons(polygon)

    def ring(line: shapely.Geometry) -> tuple[tuple[float, float], ...]:
        return tuple((float(a), float(b)) for a, b in shapely.get_coordinates(line)[:-1])

    return Surface(
        name=name,
        plane=Plane.through(origin, normal),
        origin_m=vector(origin),
        u=vector(axes[:, 0]),
        v=vector(axes[:, 1]),
        outline_m=ring(polygon.exterior),
        holes_m=tuple(ring(hole) for hole in polygon.interiors),
        hull_m=ring(polygon.convex_hull.exterior),
        area_m2=float(polygon.area),
    )


@dataclass(frozen=True)
class _Sight:
    scene: Scene
    target: ScanTarget
    step_deg: float
    widest_gap_m: float

    def of(self, places_m: Array, normals: Array) -> npt.NDArray[np.bool_]:
        """(N,) whether rays of some station meet the place, at most so far apart."""
        seen = np.zeros(len(places_m), dtype=bool)
        lifted = places_m + LIFT_M * normals
        for station in self.scene.stations_m:
            ray = lifted - np.asarray(station)
            range_m = np.linalg.norm(ray, axis=1)
            slant = -np.einsum("ni,ni->n", ray, normals) / range_m
            gap_m = range_m * np.radians(self.step_deg) / np.maximum(slant, 1e-6)
            near = np.flatnonzero((slant > 0) & (gap_m <= self.widest_gap_m) & ~seen)
            if len(near):
                hits = self.target.cast(station, ray[near] / range_m[near, None])
                seen[near] = hits.distance_m > range_m[near] - LIFT_M / 2
        return seen
