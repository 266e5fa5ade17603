"""The structure drawn to a picture: surfaces in colour with their names, ground pale, obstacles dark."""

import numpy as np
import numpy.typing as npt
from matplotlib import colormaps
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d.art3d import Poly3DCollection
from mpl_toolkits.mplot3d.axes3d import Axes3D

from schemas.structure import Structure
from tasks.surfaces.naming import middle_m

VIEWS_DEG = ((25.0, -60.0), (-20.0, -60.0))  # elevation, azimuth: from above, and from below for soffits
BESIDE_M = 2.0  # of ground shown around what stands on it


def draw_structure(structure: Structure) -> npt.NDArray[np.uint8]:
    """(H, W, 3) RGB: the structure from above and from below."""
    figure = Figure(figsize=(14, 7), dpi=100)
    canvas = FigureCanvasAgg(figure)
    low, high = _extent(structure)
    for number, (elevation, azimuth) in enumerate(VIEWS_DEG, start=1):
        axes: Axes3D = figure.add_subplot(1, 2, number, projection="3d", proj_type="ortho")
        axes.view_init(elevation, azimuth)
        for index, surface in enumerate(structure.surfaces):
            is_ground = surface.name.startswith("ground")
            corners = np.clip(surface.to_world(surface.outline_m), low, high)
            colour = (0.85, 0.85, 0.8) if is_ground else colormaps["tab20"](index % 20)
            axes.add_collection3d(
                Poly3DCollection([corners], facecolor=colour, edgecolor="black", linewidth=0.3, alpha=0.7)
            )
            if not is_ground:
                axes.text(*middle_m(surface), surface.name, fontsize=6, ha="center")
        for obstacle in structure.obstacles:
            axes.plot(*np.asarray(obstacle.hull_m).T, "k.", markersize=1)
        axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]))
        axes.set(xlabel="east [m]", ylabel="north [m]", zlabel="up [m]")
        axes.set_aspect("equal")
    figure.tight_layout()
    canvas.draw()  # type: ignore[no-untyped-call]
    rgba = np.asarray(canvas.buffer_rgba())  # type: ignore[no-untyped-call]
    return rgba[..., :3].copy()


def _extent(structure: Structure) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """Low and high corner of what is inspected; of all surfaces where there is nothing but ground."""
    shown = [s for s in structure.surfaces if not s.name.startswith("ground")] or list(structure.surfaces)
    corners = np.concatenate([surface.to_world(surface.outline_m) for surface in shown])
    return corners.min(axis=0) - BESIDE_M, corners.max(axis=0) + BESIDE_M
