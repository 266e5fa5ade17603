"""Seams: they keep to the middle of overlaps, cross cracks head on, and never run along one."""

import numpy as np
import numpy.typing as npt
import pytest

from schemas.camera import Camera
from tasks.stitching.canvas import lay_out
from tasks.stitching.seams import NONE, Partition, darkness, label_window, partition
from tasks.stitching.view import FACING, View

CAMERA = Camera(width_px=800, height_px=640, focal_px=800.0)
LEFT = View(CAMERA, FACING, np.array([0.0, 0.0, 1.0]))
RIGHT = View(CAMERA, FACING, np.array([0.5, 0.0, 1.0]))  # 400 px on: half a photo of overlap
CANVAS = lay_out("wall", [LEFT, RIGHT], None, None)

Labels = npt.NDArray[np.int32]


def wall(crack: npt.NDArray[np.float64] | None = None) -> list[npt.NDArray[np.uint8]]:
    """Both photos of a rough wall; `crack` (N, 2): canvas pixels of a dark line, 3 px wide."""
    rng = np.random.default_rng(0)
    grey = rng.normal(150, 4, (700, 1300))
    if crack is not None:
        for x, y in np.rint(crack).astype(int):
            grey[y - 1 : y + 2, x - 1 : x + 2] = 60
    photos = []
    for view in (LEFT, RIGHT):
        x0, y0, _, _ = CANVAS.bounds_px(view)
        photos.append(np.repeat(grey[y0 : y0 + 640, x0 : x0 + 800, None], 3, axis=2).astype(np.uint8))
    return photos


def labels(photos: list[npt.NDArray[np.uint8]], worth: tuple[float, float] = (1.0, 1.0)) -> Labels:
    views = [LEFT, RIGHT]
    parted = partition(views, worth, CANVAS, [darkness(photo) for photo in photos])
    return label_window(views, worth, CANVAS, parted, 0, 0, CANVAS.width_px, CANVAS.height_px)


def seam_x(label: Labels) -> npt.NDArray[np.float64]:
    """(rows,) where each row passes from the left photo to the right one, in the rows that have both."""
    rows = label[20:-20]
    assert ((rows == 0).any(axis=1) & (rows == 1).any(axis=1)).all()
    return np.asarray((rows == 0).sum(axis=1), float)


def line(x0: float, y0: float, x1: float, y1: float) -> npt.NDArray[np.float64]:
    t = np.linspace(0, 1, 2000)[:, None]
    return np.array([[x0, y0]]) * (1 - t) + np.array([[x1, y1]]) * t


def test_without_a_crack_the_seam_is_the_middle_of_the_overlap() -> None:
    label = labels(wall())
    assert (label[2:-2, 2:-2] != NONE).all()
    assert np.abs(seam_x(label) - 600).max() < 40


def test_a_blurred_photo_gets_less() -> None:
    assert seam_x(labels(wall(), worth=(1.0, 0.5))).mean() > seam_x(labels(wall())).mean() + 40


def test_a_crack_along_the_middle_comes_from_one_photo() -> None:
    """It wanders about the seam that there would be: that one would cross it, or run on it, all the way."""
    y = np.arange(120.0, 520.0)
    crack = np.column_stack([600 + 15 * np.sin(y / 25), y])
    label = labels(wall(crack))
    on_crack = label[crack[:, 1].astype(int), np.rint(crack[:, 0]).astype(int)]
    assert len(np.unique(on_crack)) == 1
    away = np.abs(seam_x(label)[120 - 20 : 520 - 20] - crack[:, 0])
    assert away.min() > 8


def test_a_crack_across_the_overlap_is_crossed_once() -> None:
    label = labels(wall(line(250, 200, 950, 430)))
    t = line(250, 200, 950, 430)
    on_crack = label[np.rint(t[:, 1]).astype(int), np.rint(t[:, 0]).astype(int)]
    assert np.count_nonzero(np.diff(on_crack)) == 1


@pytest.mark.parametrize("corner", [(0, 0), (24, 16), (-37, -5), (70, 40)])
def test_a_window_has_the_labels_of_its_cells(corner: tuple[int, int]) -> None:
    """On and beyond a partition of 80 × 48 pixels."""
    label = np.arange(60, dtype=np.int32).reshape(6, 10)
    whole = np.full((248, 280), NONE, np.int32)
    whole[100:148, 100:180] = np.kron(label, np.ones((8, 8), np.int32))
    x, y = corner
    window = Partition(label, 8).window(x, y, 45, 30)
    np.testing.assert_array_equal(window, whole[100 + y : 130 + y, 100 + x : 145 + x])


def test_a_window_is_part_of_the_whole() -> None:
    photos = wall(line(250, 200, 950, 430))
    views = [LEFT, RIGHT]
    parted = partition(views, (1.0, 1.0), CANVAS, [darkness(photo) for photo in photos])
    whole = label_window(views, (1.0, 1.0), CANVAS, parted, -16, -16, 1280, 704)
    part = label_window(views, (1.0, 1.0), CANVAS, parted, 483, 101, 300, 200)
    assert (part == whole[117:317, 499:799]).all()
    assert (whole[:16] == NONE).all()
