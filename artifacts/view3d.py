"""The structure, the flight and the cloud as a person standing beside them would see them."""

import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt
import shapely
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patheffects import withStroke
from scipy.spatial import ConvexHull, QhullError

from artifacts import palette
from artifacts.orthographic import Canvas, View, shaded
from schemas.contract import Vector3
from schemas.crack import Crack
from schemas.flight_log import FlightLog
from schemas.flight_plan import FlightPlan
from schemas.obstacle import Obstacle
from schemas.structure import Structure
from schemas.surface import Surface

Array = npt.NDArray[np.float64]
SUPERSAMPLED = 2
ABOVE_DEG, BELOW_DEG = 24.0, -20.0
MOST_LABELS = 30
LEGEND_PX = 46


@dataclass(frozen=True)
class Scene:
    """What to draw. colours: of surfaces by name, where they are not to differ merely by their order."""

    structure: Structure | None = None
    plan: FlightPlan | None = None
    log: FlightLog | None = None
    cracks: Sequence[Crack] = ()
    colours: Mapping[str, str] | None = None

    @property
    def surfaces(self) -> tuple[Surface, ...]:
        return self.structure.surfaces if self.structure else ()

    def colour(self, surface: Surface) -> str:
        if is_ground(surface):
            return palette.GROUND
        if self.colours is not None:
            return self.colours.get(surface.name, "#c3cbd3")
        return palette.pale(palette.series([s.name for s in self.surfaces].index(surface.name)))


def is_ground(surface: Surface) -> bool:
    """By the name that extraction gives it: ground is stood on, not inspected."""
    return surface.name.startswith("ground")


def has_underside(scene: Scene) -> bool:
    return any(s.plane.normal[2] < -0.5 for s in scene.surfaces)


def picture(scene: Scene, width_px: int = 1500, height_px: int = 900, from_below: bool = False) -> bytes:
    """PNG of a scene from the side that shows most of its surfaces, from above or from below."""
    view = View(
        _extent_m(scene),
        best_azimuth_deg(scene, from_below),
        BELOW_DEG if from_below else ABOVE_DEG,
        SUPERSAMPLED * width_px,
        SUPERSAMPLED * (height_px - LEGEND_PX),
    )
    canvas = Canvas(view)
    stroke = max(1, round(SUPERSAMPLED * width_px / 1500))
    ordered = sorted(scene.surfaces, key=lambda s: s.name)
    for surface in ordered:
        if from_below and is_ground(surface):
            continue
        rings = [surface.to_world(ring) for ring in (surface.outline_m, *surface.holes_m)]
        canvas.polygon(rings, shaded(scene.colour(surface), surface.plane.normal, view.to_viewer))
    for obstacle in scene.structure.obstacles if scene.structure else ():
        for triangle, normal in _faces(obstacle):
            canvas.polygon([triangle], shaded(palette.OBSTACLE, normal, view.to_viewer))
    for surface in ordered:
        if from_below and is_ground(surface):
            continue
        edge = _darker(scene.colour(surface))
        for ring in (surface.outline_m, *surface.holes_m):
            canvas.line(surface.to_world([*ring, ring[0]]), edge, stroke, behind=0.12)
    for crack in scene.cracks:
        canvas.line(crack.polyline_world_m, palette.SEVERITY[crack.severity], 4 * stroke, lift_m=0.15)
    if scene.plan is not None:
        _draw_plan(canvas, scene.plan, stroke)
    if scene.log is not None:
        canvas.line([point.position_m for point in scene.log.track], palette.FLOWN, 2 * stroke)
    return _annotated(canvas, scene, width_px, height_px)


def cloud_picture(
    points_m: npt.ArrayLike,
    stations: npt.ArrayLike,
    names: Sequence[str],
    station_positions_m: Sequence[Vector3] = (),
    width_px: int = 1200,
    height_px: int = 760,
) -> bytes:
    """PNG of a registered cloud, each station's points in its own colour."""
    points, which = np.asarray(points_m, dtype=float), np.asarray(stations, dtype=int)
    low, high = np.percentile(points, [0.2, 99.8], axis=0) if len(points) else (np.zeros(3), np.ones(3))
    near = np.all((points >= low - 0.5) & (points <= high + 0.5), axis=1)
    points, which = points[near], which[near]
    view = View(points, 205.0, 32.0, SUPERSAMPLED * width_px, SUPERSAMPLED * (height_px - LEGEND_PX))
    canvas = Canvas(view)
    colours = np.array(
        [palette.rgb(palette.series(i)) for i in range(max(len(names), which.max(initial=0) + 1))]
    )
    in_picture = max(1, len(points)) / (width_px * height_px * SUPERSAMPLED**2)
    canvas.points(points, colours[which], size_px=int(np.clip(0.45 / np.sqrt(in_picture), 2, 9)))
    for index, position_m in enumerate(station_positions_m):
        canvas.discs([position_m], palette.INK, 6 * SUPERSAMPLED, lift_m=1e9)
        canvas.discs([position_m], palette.series(index), 4 * SUPERSAMPLED, lift_m=1e9)
    figure, axes = _figure(canvas, width_px, height_px)
    _scale_and_axes(axes, view, width_px, height_px)
    shown = list(names)[:10]
    handles = [_dot(palette.series(i), name) for i, name in enumerate(shown)]
    if len(names) > len(shown):
        handles.append(_dot("none", f"and {len(names) - len(shown)} more"))
    _legend(figure, handles, width_px)
    return _png(figure)


def _draw_plan(canvas: Canvas, plan: FlightPlan, stroke: int) -> None:
    path = [plan.home_m, *(w.position_m for w in plan.waypoints), plan.home_m]
    canvas.line(path, palette.PLANNED, 2 * stroke)
    shots = plan.shooting_points
    for shot in shots:
        start = np.asarray(shot.position_m)
        canvas.line([start, start + 0.5 * shot.pose.R_world_camera[:, 2]], palette.SHOT, 2 * stroke)
    canvas.discs([shot.position_m for shot in shots], palette.SHOT, 4 * stroke)
    canvas.discs([plan.home_m], "#ffffff", 11 * stroke, lift_m=1e9)
    canvas.discs([plan.home_m], palette.INK, 9 * stroke, lift_m=1e9)


def _extent_m(scene: Scene) -> Array:
    """The corners that must be in the picture; wide ground is cropped to what stands on it."""
    solid = [s.to_world(s.outline_m) for s in scene.surfaces if not is_ground(s)]
    solid += [
        np.asarray(o.hull_m) for o in (scene.structure.obstacles if scene.structure else ()) if o.hull_m
    ]
    flown = [np.array([p.position_m for p in scene.log.track])] if scene.log and scene.log.track else []
    planned = (
        [np.array([scene.plan.home_m, *(w.position_m for w in scene.plan.waypoints)])] if scene.plan else []
    )
    corners = [*solid, *flown, *planned] or [s.to_world(s.outline_m) for s in scene.surfaces]
    return np.vstack(corners) if corners else np.zeros((0, 3))


def best_azimuth_deg(scene: Scene, from_below: bool = False) -> float:
    """Where to stand, clockwise from north: where most area is seen, rather many faces obliquely than one
    from its front."""
    elevation = np.radians(BELOW_DEG if from_below else ABOVE_DEG)
    best, best_seen = 205.0, -1.0
    for azimuth_deg in range(5, 365, 10):
        a = np.radians(azimuth_deg)
        to_viewer = np.array(
            [np.sin(a) * np.cos(elevation), np.cos(a) * np.cos(elevation), np.sin(elevation)]
        )
        seen = sum(
            s.area_m2 * float(np.sqrt(np.clip(np.asarray(s.plane.normal) @ to_viewer, 0.0, 0.8)))
            for s in scene.surfaces
            if not is_ground(s) and (scene.colours is None or s.name in scene.colours)
        )
        if seen > best_seen + 1e-6:
            best, best_seen = float(azimuth_deg), seen
    return best


def _faces(obstacle: Obstacle) -> list[tuple[Array, Array]]:
    """Triangles of its convex hull with their outward normals; nothing of a flat one."""
    corners = np.asarray(obstacle.hull_m, dtype=float).reshape(-1, 3)
    try:
        hull = ConvexHull(corners)
    except (QhullError, ValueError):
        return []
    order = np.lexsort(np.sort(hull.simplices, axis=1).T)
    return [(corners[hull.simplices[i]], hull.equations[i, :3]) for i in order]


def _darker(colour: str) -> str:
    return "#" + "".join(f"{int(channel * 0.62):02x}" for channel in palette.rgb(colour))


# -- what is written over it ---------------------------------------------------------------------------


def _annotated(canvas: Canvas, scene: Scene, width_px: int, height_px: int) -> bytes:
    figure, axes = _figure(canvas, width_px, height_px)
    font_px = max(11.0, width_px / 95)
    _surface_labels(axes, canvas, scene, font_px)
    if scene.plan is not None:
        x, y, _ = canvas.view.project([scene.plan.home_m])[0] / SUPERSAMPLED
        axes.text(x, y, "H", color="white", fontsize=0.62 * font_px, weight="bold", ha="center", va="center")
    _scale_and_axes(axes, canvas.view, width_px, height_px)
    handles = []
    if scene.plan is not None:
        handles += [_stroke(palette.PLANNED, "planned path"), _dot(palette.SHOT, "shooting point")]
        handles.append(_dot(palette.INK, "home"))
    if scene.log is not None:
        handles.append(_stroke(palette.FLOWN, "flown path"))
    if scene.structure is not None and scene.structure.obstacles:
        handles.append(_dot(palette.OBSTACLE, "obstacle"))
    present = {crack.severity for crack in scene.cracks if crack.polyline_world_m}
    handles += [
        _stroke(palette.SEVERITY[s], f"{s} crack") for s in (*palette.SEVERITIES, None) if s in present and s
    ]
    if None in present:
        handles.append(_stroke(palette.SEVERITY[None], "crack"))
    _legend(figure, handles, width_px)
    return _png(figure)


def _surface_labels(axes: Axes, canvas: Canvas, scene: Scene, font_px: float) -> None:
    """Names at the middle of what is seen, the largest first, none over another."""
    taken: list[tuple[float, float, float, float]] = []
    named = [s for s in scene.surfaces if not is_ground(s)]
    for surface in sorted(named, key=lambda s: (-s.area_m2, s.name))[:MOST_LABELS]:
        if float(np.asarray(surface.plane.normal) @ canvas.view.to_viewer) < 0.05:
            continue
        inner = shapely.Polygon(surface.outline_m, surface.holes_m).buffer(0).representative_point()
        x, y, depth = canvas.view.project(surface.to_world([(inner.x, inner.y)]))[0]
        column, row = round(float(x)), round(float(y))
        if not (0 <= column < canvas.view.width_px and 0 <= row < canvas.view.height_px):
            continue
        if depth > canvas.depth_m[row, column] + 0.05:
            continue
        half_w, half_h = 0.30 * font_px * len(surface.name), 0.75 * font_px
        cx, cy = x / SUPERSAMPLED, y / SUPERSAMPLED
        box = (cx - half_w, cy - half_h, cx + half_w, cy + half_h)
        if any(box[0] < t[2] and t[0] < box[2] and box[1] < t[3] and t[1] < box[3] for t in taken):
            continue
        taken.append(box)
        _text(axes, cx, cy, surface.name, 0.72 * font_px)


def _text(axes: Axes, x: float, y: float, text: str, size: float, weight: str = "bold") -> None:
    axes.text(
        x,
        y,
        text.replace("$", r"\$"),
        color=palette.INK,
        fontsize=size,
        weight=weight,
        ha="center",
        va="center",
        path_effects=[withStroke(linewidth=3, foreground="white", alpha=0.85)],
    )


def _scale_and_axes(axes: Axes, view: View, width_px: int, height_px: int) -> None:
    """A scale bar at the lower left and east, north, up at the lower right."""
    px_per_m = view.px_per_m / SUPERSAMPLED
    bar_m = nice_length(0.16 * width_px / px_per_m)
    font = max(11.0, width_px / 95)
    x0, y0 = 0.03 * width_px, height_px - LEGEND_PX - 1.4 * font
    plot = axes.plot
    plot([x0, x0 + bar_m * px_per_m], [y0, y0], color=palette.INK, lw=2.5, solid_capstyle="butt")
    for x in (x0, x0 + bar_m * px_per_m):
        plot([x, x], [y0 - 5, y0 + 5], color=palette.INK, lw=1.2)
    _text(axes, x0 + bar_m * px_per_m / 2, y0 - 0.95 * font, f"{bar_m:g} m", 0.72 * font, "normal")
    length = 2.6 * font
    origin = np.array([width_px - 5 * font, height_px - LEGEND_PX - 4.0 * font])
    for name, axis, colour in (("E", 0, "#c1121f"), ("N", 1, "#2b8a3e"), ("Up", 2, "#1c5fb0")):
        step = view.axes[:2, axis] * length
        if np.hypot(*step) < 3:
            continue
        plot([origin[0], origin[0] + step[0]], [origin[1], origin[1] + step[1]], color=colour, lw=2)
        x, y = origin + 1.38 * step
        _text(axes, float(x), float(y), name, 0.62 * font, "normal")


def nice_length(about: float) -> float:
    """1, 2 or 5 times a power of ten, at most `about`."""
    power = 10.0 ** np.floor(np.log10(max(about, 1e-9)))
    return float(power * max(step for step in (1, 2, 5) if step * power <= about * (1 + 1e-9)))


def _figure(canvas: Canvas, width_px: int, height_px: int) -> tuple[Figure, Axes]:
    figure = Figure(figsize=(width_px / 100, height_px / 100), dpi=100, facecolor="white")
    FigureCanvasAgg(figure)
    axes = figure.add_axes((0, LEGEND_PX / height_px, 1, 1 - LEGEND_PX / height_px))
    size = (canvas.view.width_px // SUPERSAMPLED, canvas.view.height_px // SUPERSAMPLED)
    small = cv2.resize(canvas.pixels, size, interpolation=cv2.INTER_AREA)
    figure.figimage(small, xo=0, yo=height_px - size[1], origin="upper", zorder=-1)
    axes.set_xlim(-0.5, size[0] - 0.5)
    axes.set_ylim(size[1] - 0.5, -0.5)
    axes.axis("off")
    return figure, axes


def _stroke(colour: str, name: str) -> Line2D:
    return Line2D([], [], color=colour, lw=3, label=name.replace("$", r"\$"))


def _dot(colour: str, name: str) -> Line2D:
    return Line2D([], [], color=colour, marker="o", ls="", ms=8, label=name.replace("$", r"\$"))


def _legend(figure: Figure, handles: Sequence[Line2D], width_px: int) -> None:
    if handles:
        figure.legend(
            handles=list(handles),
            loc="lower center",
            ncols=len(handles),
            frameon=False,
            fontsize=max(9.0, width_px / 130) * (1.0 if len(handles) < 8 else 0.75),
            labelcolor=palette.INK,
            handlelength=1.6,
            columnspacing=1.6,
        )


def _png(figure: Figure) -> bytes:
    stream = io.BytesIO()
    figure.savefig(stream, format="png", metadata={"Software": None})
    return stream.getvalue()
