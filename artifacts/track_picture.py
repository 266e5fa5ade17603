"""The planned path and the flown one, from above and from the side (paper, section 4.1)."""

import io

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine

from artifacts import palette
from schemas.flight_log import FlightLog
from schemas.flight_plan import FlightPlan

Array = npt.NDArray[np.float64]


def track_picture(plan: FlightPlan | None, log: FlightLog, width_px: int = 1400) -> bytes:
    """PNG of both paths; of the flown one alone where there is no plan."""
    flown = np.array([point.position_m for point in log.track]).reshape(-1, 3)
    shots = np.array([shot.pose.position_m for shot in log.shots]).reshape(-1, 3)
    planned, targets = np.zeros((0, 3)), np.zeros((0, 3))
    if plan is not None:
        planned = np.array([plan.home_m, *(w.position_m for w in plan.waypoints), plan.home_m])
        targets = np.array([w.position_m for w in plan.shooting_points]).reshape(-1, 3)
    everything = np.vstack([flown, planned, shots])
    span = np.ptp(everything, axis=0) if len(everything) else np.ones(3)
    side = 0 if span[0] >= span[1] else 1
    figure = Figure(
        figsize=(width_px / 100, 0.0043 * width_px),
        dpi=100,
        facecolor="white",
        layout=ConstrainedLayoutEngine(w_pad=0.15, h_pad=0.12),
    )
    FigureCanvasAgg(figure)
    above, beside = figure.subplots(1, 2)
    for axes, (i, j), title in ((above, (0, 1), "from above"), (beside, (side, 2), "from the side")):
        _paths(axes, planned[:, [i, j]], flown[:, [i, j]], targets[:, [i, j]], shots[:, [i, j]])
        labels = ("east, m", "north, m", "up, m")
        axes.set_xlabel(labels[i], fontsize=12)
        axes.set_ylabel(labels[j], fontsize=12)
        axes.set_title(title, fontsize=13, color=palette.INK)
    handles, names = above.get_legend_handles_labels()
    figure.legend(handles, names, loc="outside lower center", ncols=4, frameon=False, fontsize=12)
    stream = io.BytesIO()
    figure.savefig(stream, format="png", metadata={"Software": None})
    return stream.getvalue()


def _paths(axes: Axes, planned: Array, flown: Array, targets: Array, shots: Array) -> None:
    if len(planned):
        axes.plot(*planned.T, color=palette.PLANNED, lw=4, alpha=0.45, label="planned path")
        axes.scatter(
            targets[:, 0],
            targets[:, 1],
            s=42,
            facecolors="none",
            edgecolors=palette.PLANNED,
            label="shooting point",
        )
    axes.plot(*flown.T, color=palette.FLOWN, lw=1.6, label="flown path")
    if len(shots):
        axes.scatter(shots[:, 0], shots[:, 1], s=12, color=palette.FLOWN, label="photo taken", zorder=3)
    axes.set_aspect("equal", adjustable="datalim")
    axes.grid(color="#e3e8ec")
    axes.set_axisbelow(True)
    axes.tick_params(labelsize=11)
    for spine in axes.spines.values():
        spine.set_color("#c5ced6")
