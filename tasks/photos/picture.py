"""A calibration drawn to a picture: where on the sensor the corners lie, and how far off they are."""

import numpy as np
import numpy.typing as npt
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from schemas.calibration import Calibration

LONG = 0.03  # of the frame's width: how long the largest residual is drawn


def draw_calibration(made: Calibration) -> npt.NDArray[np.uint8]:
    """(H, W, 3) RGB: corners over the frame with their residuals, and each photo's RMS."""
    width, height = made.camera.width_px, made.camera.height_px
    figure = Figure(figsize=(14, 7), dpi=100, layout="constrained")
    canvas = FigureCanvasAgg(figure)
    frame, bars = figure.subplots(1, 2, width_ratios=(2, 1))
    px = np.concatenate([np.array(view.corners_px) for view in made.views])
    off = np.concatenate([np.array(view.residuals_px) for view in made.views])
    number = np.repeat(np.arange(len(made.views)), [len(view.corners_px) for view in made.views])
    largest = max(float(np.hypot(*off.T).max()), 1e-9)
    frame.scatter(*px.T, c=number, cmap="turbo", s=7, linewidths=0)
    frame.quiver(
        *px.T,
        *off.T,
        angles="xy",
        scale_units="xy",
        scale=largest / (LONG * width),
        width=0.0012,
        color="0.35",
    )
    frame.set(xlim=(-0.5, width - 0.5), ylim=(height - 0.5, -0.5), aspect="equal", xlabel="px", ylabel="px")
    frame.set_title(
        f"{len(px)} corners of {len(made.views)} photos over {made.covered:.0%} of the frame;"
        f" lines: residuals, the longest {largest:.2f} px"
    )
    names = [
        view.name if len(view.name) <= 24 else f"{view.name[:10]}…{view.name[-12:]}" for view in made.views
    ]
    bars.barh(range(len(names)), [view.rms_px for view in made.views], color="#4c78a8")
    bars.axvline(made.rms_px, color="#c65d57", linewidth=1)
    bars.set_yticks(range(len(names)), names, fontsize=8)
    bars.invert_yaxis()
    bars.set(xlabel="RMS of each photo, px", title=f"RMS {made.rms_px:.3f} px")
    canvas.draw()  # type: ignore[no-untyped-call]
    return np.asarray(canvas.buffer_rgba())[..., :3].copy()  # type: ignore[no-untyped-call]
