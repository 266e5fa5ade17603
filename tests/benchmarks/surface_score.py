"""Extracted surfaces and obstacles against what the scanners of a simulated scene truly saw."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt
import shapely
from scipy.spatial import cKDTree

from schemas.obstacle import Obstacle
from schemas.surface import Surface
from tasks.simulation.scene import Scene
from tasks.simulation.seen_surfaces import CurvedPart, curved_parts, seen_surfaces

Floats = npt.NDArray[np.float64]
PLAIN_GAP_M, FAINT_GAP_M = 0.2, 0.8  # between rays: what must be found, what may be
PLAIN_M2, FAINT_M2 = 0.6, 0.3  # a fifth above the smallest surface asked for; what may be found
PLAIN_WIDE_M = 0.2  # narrower ones may be found and need not be
SAME_DEG, SAME_M, SAME_IOU = 5.0, 0.05, 0.5
CURVED_DEG, SAMPLE_M = 30.0, 0.04
LARGE_OBSTACLE_M = 0.3


@dataclass(frozen=True)
class Truth:
    """plain: surfaces that must be found; faint: these and others that may be."""

    plain: tuple[Surface, ...]
    faint: tuple[Surface, ...]
    curved: tuple[CurvedPart, ...]

    @classmethod
    def of(cls, scene: Scene, step_deg: float) -> "Truth":
        plain = seen_surfaces(scene, step_deg, PLAIN_GAP_M, PLAIN_WIDE_M)
        faint = (
            *seen_surfaces(scene, step_deg, PLAIN_GAP_M),
            *plain,
            *seen_surfaces(scene, step_deg, FAINT_GAP_M, glass=True),
            *seen_surfaces(scene, step_deg, FAINT_GAP_M, PLAIN_WIDE_M, glass=True),
        )
        return cls(
            tuple(s for s in plain if s.area_m2 >= PLAIN_M2),
            tuple(s for s in faint if s.area_m2 >= FAINT_M2),
            curved_parts(scene, step_deg, PLAIN_GAP_M),
        )


@dataclass(frozen=True)
class SurfaceScore:
    missed: tuple[str, ...]
    wrong: tuple[str, ...]
    recall: float
    precision: float
    normal_deg: Floats  # of each found plain surface
    offset_m: Floats  # at its middle
    coverage: Floats  # of each curved part, share of its area with a strip
    deviation_m: float  # 95 % of the curved area within


def score_surfaces(found: tuple[Surface, ...], truth: Truth) -> SurfaceScore:
    """A flat surface is found where one agrees within 5°, 5 cm and IoU > 0.5; a curved part where strips
    cover more than half of it (their area outside it counts against); the ground is left out."""
    found = tuple(s for s in found if not s.name.startswith("ground"))
    shapes = [_Shape(s) for s in found]
    plain = np.array([[shape.iou(t) for t in truth.plain] for shape in shapes]).reshape(len(found), -1)
    faint = np.array([[shape.iou(t) for t in truth.faint] for shape in shapes]).reshape(len(found), -1)
    right = faint.max(axis=1, initial=0.0) > SAME_IOU
    on_curve = np.array([[shape.share_on(part) for part in truth.curved] for shape in shapes])
    on_curve = on_curve.reshape(len(found), -1)
    strip = ~right & (on_curve.max(axis=1, initial=0.0) > SAME_IOU)
    best = plain.max(axis=0, initial=0.0)
    pairs = [(found[int(plain[:, j].argmax())], t) for j, t in enumerate(truth.plain) if best[j] > SAME_IOU]
    coverage, deviations = [], [np.zeros(0)]
    for number, part in enumerate(truth.curved):
        own = [shapes[k] for k in np.flatnonzero(strip & (on_curve[:, number] > SAME_IOU))]
        height = np.full(len(part.points_m), np.inf)
        for shape in own:
            height = np.minimum(height, shape.height_m(part))
        outside_m2 = sum(s.polygon.area * (1 - s.share_on(part)) for s in own)
        covered = float(np.isfinite(height).mean())
        coverage.append(covered * part.area_m2 / (part.area_m2 + outside_m2))
        deviations.append(height[np.isfinite(height)])
    parts_found = sum(c > SAME_IOU for c in coverage)
    deviation = np.concatenate(deviations)
    wanted = len(truth.plain) + len(truth.curved)
    return SurfaceScore(
        missed=tuple(
            f"{t.name} {t.area_m2:.2f} m²" for t, b in zip(truth.plain, best, strict=True) if b <= SAME_IOU
        ),
        wrong=tuple(
            f"{s.name} {s.area_m2:.2f} m²" for s, ok in zip(found, right | strip, strict=True) if not ok
        ),
        recall=(len(pairs) + parts_found) / wanted,
        precision=float((right | strip).mean()) if found else 0.0,
        normal_deg=np.array([_angle_deg(s, t) for s, t in pairs]),
        offset_m=np.array([abs(float(t.plane.signed_distance_m(_middle(s)))) for s, t in pairs]),
        coverage=np.array(coverage),
        deviation_m=float(np.quantile(deviation, 0.95)) if len(deviation) else 0.0,
    )


def obstacles_found(
    obstacles: tuple[Obstacle, ...],
    surfaces: tuple[Surface, ...],
    points_m: Floats,
    seen: list[npt.NDArray[np.bool_]],
) -> list[bool]:
    """For each true thing, given as which points (N,) are of it: half of them within its obstacles' boxes,
    or on surfaces that it was taken for."""
    held = np.zeros(len(points_m), dtype=bool)
    for obstacle in obstacles:
        low, high = np.asarray(obstacle.min_m) - 0.05, np.asarray(obstacle.max_m) + 0.05
        held |= ((points_m >= low) & (points_m <= high)).all(axis=1)
    for surface in surfaces:
        if not surface.name.startswith("ground"):
            uvw = surface.to_surface(points_m)
            reach = shapely.Polygon(surface.outline_m, surface.holes_m).buffer(0.05)
            near = np.flatnonzero(np.abs(uvw[:, 2]) < 0.05)
            held[near[shapely.contains_xy(reach, uvw[near, 0], uvw[near, 1])]] = True
    return [bool(held[own].mean() > 0.5) for own in seen]


class _Shape:
    def __init__(self, surface: Surface) -> None:
        self.surface = surface
        self.polygon = shapely.Polygon(surface.outline_m, surface.holes_m).buffer(0)
        shapely.prepare(self.polygon)

    def iou(self, other: Surface) -> float:
        if _angle_deg(self.surface, other) > SAME_DEG:
            return 0.0
        rings = [self.surface.to_surface(other.to_world(r)) for r in (other.outline_m, *other.holes_m)]
        if abs(float(np.median(rings[0][:, 2]))) > SAME_M:
            return 0.0
        polygon = shapely.Polygon(rings[0][:, :2], [r[:, :2] for r in rings[1:]]).buffer(0)
        return float(self.polygon.intersection(polygon).area / self.polygon.union(polygon).area)

    @cached_property
    def samples_m(self) -> Floats:
        u0, v0, u1, v1 = self.polygon.bounds
        u, v = np.meshgrid(np.arange(u0, u1, SAMPLE_M), np.arange(v0, v1, SAMPLE_M))
        uv = np.column_stack([u.ravel(), v.ravel()])
        return self.surface.to_world(uv[shapely.contains_xy(self.polygon, *uv.T)])

    def share_on(self, part: CurvedPart) -> float:
        """Of the surface's area, within 5 cm of the curved part and turned as it is to 30°."""
        away, near = cKDTree(part.points_m).query(self.samples_m)
        facing = part.normals[near] @ np.asarray(self.surface.plane.normal)
        return float(((away < SAME_M) & (facing > np.cos(np.radians(CURVED_DEG)))).mean())

    def height_m(self, part: CurvedPart) -> Floats:
        """(N,) of the part's places above or below the surface, inf where it does not cover them."""
        uvw = self.surface.to_surface(part.points_m)
        facing = part.normals @ np.asarray(self.surface.plane.normal)
        on = (np.abs(uvw[:, 2]) < SAME_M) & (facing > np.cos(np.radians(CURVED_DEG)))
        on &= shapely.contains_xy(self.polygon, uvw[:, 0], uvw[:, 1])
        return np.asarray(np.where(on, np.abs(uvw[:, 2]), np.inf))


def _angle_deg(one: Surface, other: Surface) -> float:
    return float(np.degrees(np.arccos(np.clip(np.dot(one.plane.normal, other.plane.normal), -1, 1))))


def _middle(surface: Surface) -> Floats:
    centre = shapely.Polygon(surface.outline_m, surface.holes_m).centroid
    return surface.to_world([[centre.x, centre.y]])[0]
