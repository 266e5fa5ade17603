"""What the report's orbitable view shows: layers of points, lines and triangles, ready for WebGL.

Coordinates are metres from the scene's middle in float32, so that they stay exact however far the world's
origin is. templates/orbit.js draws them.
"""

import base64
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
import numpy.typing as npt
import shapely
from scipy.spatial import ConvexHull, QhullError

from artifacts import palette
from artifacts.view3d import Scene, best_azimuth_deg, is_ground
from schemas.flight_plan import FlightPlan
from schemas.obstacle import Obstacle
from schemas.surface import Surface

Array = npt.NDArray[np.float64]
MOST_CLOUD_POINTS = 60_000  # 0.9 MB of the page
MOST_FRUSTA = 1_500
FRUSTUM_SHARE = 0.3  # of the distance to the surface that a drawn frustum reaches


@dataclass(frozen=True)
class Layer:
    """One switch of the view. positions_m: (N, 3) corners, three a triangle or two a line; colours (N, 3)."""

    name: str
    kind: str  # triangles, lines, points
    positions_m: Array
    colours: npt.NDArray[np.uint8]
    width_px: float = 1.0  # of lines and points
    shown: bool = True


def orbit_view(
    scene: Scene, cloud: tuple[Array, npt.NDArray[np.intp]] | None = None
) -> dict[str, Any] | None:
    """What the page's script reads, as JSON: the layers, the labels and the extent; None of an empty scene.

    cloud: (N, 3) world metres and (N,) station indices."""
    layers = [layer for layer in _layers(scene, cloud) if len(layer.positions_m)]
    solid = [layer.positions_m for layer in layers if layer.name not in ("Ground", "Cloud by station")]
    corners = np.vstack(solid or [layer.positions_m for layer in layers]) if layers else np.zeros((0, 3))
    if not len(corners):
        return None
    low, high = np.percentile(corners, [0.5, 99.5], axis=0)
    middle = (low + high) / 2
    return {
        "azimuth_deg": best_azimuth_deg(scene),
        "radius_m": round(float(np.linalg.norm(high - low)) / 2, 3),
        "layers": [_encoded(layer, middle) for layer in layers],
        "labels": [_label(surface, middle) for surface in scene.surfaces if not is_ground(surface)],
    }


def _layers(scene: Scene, cloud: tuple[Array, npt.NDArray[np.intp]] | None) -> Iterable[Layer]:
    surfaces = [s for s in scene.surfaces if not is_ground(s)]
    yield _solid("Surfaces", [(_triangles(s), scene.colour(s)) for s in surfaces])
    rings = [s.to_world([*ring, ring[0]]) for s in surfaces for ring in (s.outline_m, *s.holes_m)]
    yield _lines("Outlines", [(ring, palette.FAINT) for ring in rings], 1.2)
    yield _solid("Ground", [(_triangles(s), palette.GROUND) for s in scene.surfaces if is_ground(s)])
    obstacles = scene.structure.obstacles if scene.structure else ()
    yield _solid("Obstacles", [(_hull(o), palette.OBSTACLE) for o in obstacles])
    if cloud is not None:
        yield _cloud(*cloud, shown=not surfaces)
    if scene.plan is not None:
        path = [scene.plan.home_m, *(w.position_m for w in scene.plan.waypoints), scene.plan.home_m]
        yield _lines("Planned path", [(np.asarray(path), palette.PLANNED)], 2.0)
        yield _lines("What each photo sees", _frusta(scene.plan), 1.0, shown=not scene.cracks)
    if scene.log is not None and scene.log.track:
        flown = np.array([point.position_m for point in scene.log.track])
        yield _lines("Flown path", [(flown, palette.FLOWN)], 2.0)
    cracks = [(np.asarray(c.polyline_world_m), palette.SEVERITY[c.severity]) for c in scene.cracks]
    yield _lines("Cracks", [(line, colour) for line, colour in cracks if len(line) > 1], 4.0)


def _solid(name: str, faces: Sequence[tuple[Array, str]]) -> Layer:
    corners = [np.zeros((0, 3)), *(triangles for triangles, _ in faces)]
    colours = [np.tile(palette.rgb(colour), (len(triangles), 1)) for triangles, colour in faces]
    return Layer(name, "triangles", np.vstack(corners), _stacked(colours))


def _lines(name: str, lines: Sequence[tuple[Array, str]], width_px: float, shown: bool = True) -> Layer:
    segments = [np.zeros((0, 3))]
    colours = []
    for line, colour in lines:
        ends = np.array([end for pair in pairwise(line) for end in pair]).reshape(-1, 3)
        segments.append(ends)
        colours.append(np.tile(palette.rgb(colour), (len(ends), 1)))
    return Layer(name, "lines", np.vstack(segments), _stacked(colours), width_px, shown)


def _cloud(points_m: Array, stations: npt.NDArray[np.intp], shown: bool) -> Layer:
    step = max(1, -(-len(points_m) // MOST_CLOUD_POINTS))
    series = np.array([palette.rgb(palette.series(i)) for i in range(int(stations.max(initial=0)) + 1)])
    return Layer(
        "Cloud by station", "points", points_m[::step], series[stations[::step]].astype(np.uint8), 2.0, shown
    )


def _stacked(colours: Sequence[npt.NDArray[np.uint8]]) -> npt.NDArray[np.uint8]:
    return np.vstack([np.zeros((0, 3), dtype=np.uint8), *colours])


def _triangles(surface: Surface) -> Array:
    """(3 n, 3) world corners of the triangles of its outline less its holes."""
    flat = shapely.Polygon(surface.outline_m, surface.holes_m).buffer(0)
    pieces = shapely.constrained_delaunay_triangles(flat).geoms
    corners = np.array([piece.exterior.coords[:3] for piece in pieces]).reshape(-1, 2)
    return surface.to_world(corners) if len(corners) else np.zeros((0, 3))


def _hull(obstacle: Obstacle) -> Array:
    corners = np.asarray(obstacle.hull_m, dtype=float).reshape(-1, 3)
    try:
        simplices = ConvexHull(corners).simplices
    except (QhullError, ValueError):
        return np.zeros((0, 3))
    order = np.lexsort(np.sort(simplices, axis=1).T)
    return np.asarray(corners[simplices[order]].reshape(-1, 3))


def _frusta(plan: FlightPlan) -> list[tuple[Array, str]]:
    """Each shot as a pyramid from the camera towards the surface."""
    camera = plan.camera
    distance_m = {seen.surface: seen.stand_off_m for seen in plan.coverage}
    shots = plan.shooting_points
    right, down = camera.width_px / 2 / camera.focal_px, camera.height_px / 2 / camera.focal_px
    rim = np.array([(-right, -down, 1), (right, -down, 1), (right, down, 1), (-right, down, 1)])
    lines = []
    for shot in shots[:: max(1, -(-len(shots) // MOST_FRUSTA))]:
        apex = np.asarray(shot.position_m)
        reach = FRUSTUM_SHARE * distance_m.get(shot.surface or "", 1.0)
        corners = apex + reach * rim @ shot.pose.R_world_camera.T
        lines += [(np.array([apex, corner]), palette.FAINT) for corner in corners]
        lines.append((np.vstack([corners, corners[:1]]), palette.SHOT))
    return lines


def _label(surface: Surface, middle: Array) -> dict[str, Any]:
    inner = shapely.Polygon(surface.outline_m, surface.holes_m).buffer(0).representative_point()
    at = surface.to_world([(inner.x, inner.y)])[0] - middle
    return {
        "text": surface.name,
        "at": [round(float(x), 3) for x in at],
        "normal": [round(float(x), 4) for x in surface.plane.normal],
        "area_m2": round(surface.area_m2, 2),
    }


def _encoded(layer: Layer, middle: Array) -> dict[str, Any]:
    positions = (layer.positions_m - middle).astype("<f4")
    return {
        "name": layer.name,
        "kind": layer.kind,
        "width": layer.width_px,
        "shown": layer.shown,
        "positions": base64.b64encode(positions.tobytes()).decode("ascii"),
        "colours": base64.b64encode(np.ascontiguousarray(layer.colours).tobytes()).decode("ascii"),
    }
