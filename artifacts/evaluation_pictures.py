"""How well cracks were found, to look at: curves over all images, and the worst images side by side."""

import io
from collections.abc import Sequence

import cv2
import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine

from artifacts import palette
from schemas.evaluation import Curves, Evaluation
from schemas.raster import Pixels

Mask = npt.NDArray[np.bool_]

RIGHT, FALSE, MISSED = "#2f9e44", "#e03131", "#1971c2"
MARKED = (0.1, 0.25, 0.5, 0.75, 0.9)  # thresholds named on the curve
RULE_PX = 4


def curves_picture(curves: Curves, evaluations: Sequence[Evaluation]) -> bytes:
    """PNG: precision against recall, every method a point; what was said against what was."""
    figure = Figure(
        figsize=(12, 5.4), dpi=100, facecolor="white", layout=ConstrainedLayoutEngine(w_pad=0.15, h_pad=0.12)
    )
    FigureCanvasAgg(figure)
    left, right = figure.subplots(1, 2)
    _precision_recall(left, curves, evaluations)
    right.plot((0, 1), (0, 1), color=palette.FAINT, lw=1, ls="--", label="calibrated")
    right.plot(curves.said, curves.was, "o-", color=palette.ACCENT, label="network")
    _frame(right, "probability said", "share that is crack", "Calibration of single pixels")
    right.legend(frameon=False, fontsize=11, loc="upper left")
    stream = io.BytesIO()
    figure.savefig(stream, format="png", metadata={"Software": None})
    return stream.getvalue()


def _precision_recall(axes: Axes, curves: Curves, evaluations: Sequence[Evaluation]) -> None:
    axes.plot(curves.recall, curves.precision, color=palette.ACCENT, lw=2, label="network, each threshold")
    for threshold in MARKED:
        k = int(np.argmin(np.abs(np.array(curves.threshold) - threshold)))
        at = (curves.recall[k], curves.precision[k])
        axes.plot(*at, "o", ms=4, color=palette.ACCENT)
        axes.annotate(f"{threshold:g}", at, xytext=(5, 5), textcoords="offset points", fontsize=10)
    same = [one for one in evaluations if one.tolerance_px == curves.tolerance_px]
    for k, one in enumerate(same):
        point = (one.aggregate.recall, one.aggregate.precision)
        axes.plot(
            *point, "s", ms=8, color=palette.series(k), label=f"{one.method}: F1 {one.aggregate.f1:.2f}"
        )
    title = f"Precision and recall of pixels at {curves.tolerance_px} px"
    _frame(axes, "recall", "precision", title)
    axes.legend(frameon=False, fontsize=11, loc="lower left")


def _frame(axes: Axes, x: str, y: str, title: str) -> None:
    axes.set(xlim=(0, 1), ylim=(0, 1.02))
    axes.set_xlabel(x, fontsize=12)
    axes.set_ylabel(y, fontsize=12)
    axes.set_title(title, fontsize=13, color=palette.INK)
    axes.grid(color="#e3e8ec")
    axes.set_axisbelow(True)


def side_by_side(rgb: Pixels, truth: Mask, found: Mask, near_truth: Mask, near_found: Mask) -> Pixels:
    """(H, 3W, 3): the photo; on it what somebody drew; and what was found, coloured: right, false, missed."""
    drawn = _tinted(rgb, [(truth, MISSED)])
    parts = [(found & near_truth, RIGHT), (found & ~near_truth, FALSE), (truth & ~near_found, MISSED)]
    rule = np.full((rgb.shape[0], RULE_PX, 3), 255, dtype=np.uint8)
    return np.hstack([rgb, rule, drawn, rule, _tinted(rgb, parts)])


def _tinted(rgb: Pixels, parts: Sequence[tuple[Mask, str]]) -> Pixels:
    grey = cv2.cvtColor(np.ascontiguousarray(rgb), cv2.COLOR_RGB2GRAY)
    pale = np.repeat((grey // 2 + 120)[..., None], 3, axis=2)
    for mask, colour in parts:
        pale[mask] = palette.rgb(colour)
    return np.asarray(pale, dtype=np.uint8)
