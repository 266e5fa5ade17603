"""The plan drawn to a picture: inspected surfaces, the path, and where each photo is taken from."""

from collections.abc import Mapping, Sequence

import numpy as np
import numpy.typing as npt
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d.art3d import Line3DCollection, Poly3DCollection
from mpl_toolkits.mplot3d.axes3d import Axes3D

from schemas.flight_plan import FlightPlan
from schemas.surface import Surface

VIEWS_DEG = ((25.0, -60.0), (25.0, 120.0))  # elevation, azimuth: from either side
GAZE_M = 0.7  # length of the line drawn along each view


def draw_plan(plan: FlightPlan, surfaces: Sequence[Surface]) -> npt.NDArray[np.uint8]:
    """(H, W, 3) RGB: the flight from two sides."""
    places = np.array([plan.home_m, *(w.position_m for w in plan.waypoints), plan.home_m])
    shots = plan.shooting_points
    gazes = [(w.position_m, w.position_m + GAZE_M * w.pose.R_world_camera[:, 2]) for w in shots]
    planned = {c.surface: c.covered for c in plan.coverage}
    shown = [s for s in surfaces if s.name in planned]
    corners = [s.to_world(s.outline_m) for s in shown]
    extent = np.concatenate([places, *corners])
    figure = Figure(figsize=(14, 7), dpi=100)
    canvas = FigureCanvasAgg(figure)
    for number, (elevation, azimuth) in enumerate(VIEWS_DEG, start=1):
        axes: Axes3D = figure.add_subplot(1, 2, number, projection="3d", proj_type="ortho")
        axes.view_init(elevation, azimuth)
        axes.add_collection3d(Poly3DCollection(corners, facecolor="#c8c8b8", edgecolor="black", alpha=0.6))
        for surface, ring in zip(shown, corners, strict=True):
            axes.text(*ring.mean(axis=0), f"{surface.name} {planned[surface.name]:.0%}", fontsize=7)
        axes.add_collection3d(Line3DCollection(gazes, colors="tab:orange", linewidths=0.8))
        axes.plot(*places.T, color="tab:blue", linewidth=0.8)
        axes.plot(*np.array([w.position_m for w in shots]).T, ".", color="tab:red", markersize=3)
        axes.plot(*np.array([plan.home_m]).T, "k^", markersize=7)
        axes.set(
            **{f"{a}lim": (extent[:, k].min(), extent[:, k].max() + 0.1) for k, a in enumerate("xyz")},
            xlabel="east [m]",
            ylabel="north [m]",
            zlabel="up [m]",
        )
        axes.set_aspect("equal")
    figure.tight_layout()
    canvas.draw()  # type: ignore[no-untyped-call]
    return np.asarray(canvas.buffer_rgba())[..., :3].copy()  # type: ignore[no-untyped-call]


def draw_widths(maps: Mapping[str, npt.NDArray[np.float32]]) -> npt.NDArray[np.uint8]:
    """(H, W, 3) RGB: of each surface the smallest measurable crack width; white where nothing is seen."""
    columns = min(len(maps), 4) or 1
    rows = max(1, -(-len(maps) // columns))
    figure = Figure(figsize=(14, 2.6 * rows), dpi=100)
    canvas = FigureCanvasAgg(figure)
    known = [widths[np.isfinite(widths)] for widths in maps.values()]
    low = min((float(w.min()) for w in known if w.size), default=0.0)
    high = max((float(w.max()) for w in known if w.size), default=1.0)
    for number, (name, widths) in enumerate(maps.items(), start=1):
        axes = figure.add_subplot(rows, columns, number)
        shown = axes.imshow(widths, cmap="viridis_r", vmin=low, vmax=max(high, low + 1e-6))
        axes.set_title(name, fontsize=8)
        axes.set_axis_off()
        figure.colorbar(shown, ax=axes, label="mm", shrink=0.7)
    figure.tight_layout()
    canvas.draw()  # type: ignore[no-untyped-call]
    return np.asarray(canvas.buffer_rgba())[..., :3].copy()  # type: ignore[no-untyped-call]
