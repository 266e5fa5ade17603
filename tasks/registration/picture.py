"""The registered model drawn to a picture: its points in the colour of the station that saw them."""

import numpy as np
import numpy.typing as npt
from matplotlib import colormaps
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from schemas.registered_model import RegisteredModel

MOST_POINTS = 60_000
VIEWS = (("from above", 0, 1, "east [m]", "north [m]"), ("from the south", 0, 2, "east [m]", "up [m]"))


def draw_model(
    model: RegisteredModel, points_m: npt.NDArray[np.float64], station: npt.NDArray[np.intp]
) -> npt.NDArray[np.uint8]:
    """(H, W, 3) RGB of (N, 3) points and their (N,) stations, from above and from the south."""
    step = max(1, len(points_m) // MOST_POINTS)
    colours = colormaps["tab20"]
    figure = Figure(figsize=(14, 6), dpi=100)
    canvas = FigureCanvasAgg(figure)
    for number, (title, across, along, x_label, y_label) in enumerate(VIEWS, start=1):
        axes = figure.add_subplot(1, 2, number)
        axes.scatter(
            points_m[::step, across],
            points_m[::step, along],
            s=0.5,
            c=colours(station[::step] % 20),
            linewidths=0,
        )
        for index, one in enumerate(model.stations):
            x, y = one.T_world_scan[across][3], one.T_world_scan[along][3]
            axes.plot(x, y, "^", color=colours(index % 20), markeredgecolor="black")
            axes.annotate(one.name, (x, y), fontsize=8, xytext=(4, 4), textcoords="offset points")
        axes.set(title=title, xlabel=x_label, ylabel=y_label)
        axes.set_aspect("equal")
    figure.tight_layout()
    canvas.draw()  # type: ignore[no-untyped-call]
    return np.asarray(canvas.buffer_rgba())[..., :3].copy()  # type: ignore[no-untyped-call]
