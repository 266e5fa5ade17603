import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tasks.connected import Marked
from tasks.detection.joints import Joint, Run, _on_one_line, straight_run
from tasks.detection.joints import without_joints as of_pixels


def without_joints(mask: np.ndarray, joint_px: float, piece_px: float) -> tuple[np.ndarray, list[Joint]]:
    left, joints = of_pixels(Marked.of_levels(mask.astype(np.uint8)), joint_px, piece_px)
    return left.mask.whole(), joints


def line(angle_deg: float, length: float, thickness: int, size: int = 700) -> np.ndarray:
    centre = np.array([size / 2, size / 2])
    half = length / 2 * np.array([np.cos(np.radians(angle_deg)), np.sin(np.radians(angle_deg))])
    a, b = (tuple(int(n) for n in np.rint(p)) for p in (centre - half, centre + half))
    return cv2.line(np.zeros((size, size), np.uint8), a, b, 1, thickness) > 0


@settings(max_examples=30)
@given(st.floats(0, 180), st.integers(1, 8))
def test_a_straight_line_is_a_joint_in_any_direction(angle_deg: float, thickness: int) -> None:
    mask = line(angle_deg, 500, thickness)
    cleaned, joints = without_joints(mask, 400, 50)
    assert cleaned.sum() <= 0.05 * mask.sum()
    assert len(joints) == 1 and joints[0].length_px == pytest.approx(500, abs=25)


def test_a_wandering_line_is_none() -> None:
    rng = np.random.default_rng(2)
    y = 300 + np.cumsum(rng.normal(0, 0.6, 600))
    mask = np.zeros((600, 600), np.uint8)
    cv2.polylines(mask, [np.rint(np.column_stack([np.arange(600), y])).astype(np.int32)], False, 1, 3)
    cleaned, joints = without_joints(mask > 0, 400, 50)
    assert not joints and (cleaned == (mask > 0)).all()


def test_pieces_on_one_line_are_one_joint() -> None:
    mask = line(20, 600, 3)
    mask[:, 250:300], mask[:, 420:450] = False, False
    cleaned, joints = without_joints(mask, 400, 50)
    assert len(joints) == 1 and cleaned.sum() <= 0.05 * mask.sum()


def test_a_short_straight_line_may_be_a_crack() -> None:
    mask = line(70, 250, 3)
    cleaned, joints = without_joints(mask, 400, 50)
    assert not joints and (cleaned == mask).all()


def test_a_single_pixel_holds_no_run() -> None:
    assert straight_run(np.array([[3.0, 4.0]]), 50) is None


def test_an_empty_mask() -> None:
    cleaned, joints = without_joints(np.zeros((20, 30), dtype=bool), 400, 50)
    assert not cleaned.any() and not joints


def test_the_joints_of_a_regular_wall_are_joints_at_any_size() -> None:
    """Of 3000 px every 352nd pixel lies on the same few of its lines."""
    wall = np.zeros((3000, 3000), np.uint8)
    for at in range(50, 2995, 100):
        wall[at : at + 4] = wall[:, at : at + 4] = 1
    left, joints = without_joints(wall > 0, 800.0, 100.0)
    assert not left.any()
    assert len(joints) == 60


def test_the_pieces_of_many_lines_are_joined_line_by_line() -> None:
    """Two hundred lines in five pieces each, somewhere on a large mosaic."""
    rng = np.random.default_rng(3)
    runs = []
    for start, way in zip(rng.uniform(0, 30_000, (200, 2)), rng.normal(size=(200, 2)), strict=True):
        step = 100.0 * way / np.linalg.norm(way)
        runs += [Run(np.ones(1, bool), start + k * step, start + (k + 0.8) * step) for k in range(5)]
    order = rng.permutation(len(runs))
    groups = _on_one_line([runs[i] for i in order])
    assert sorted(sorted(order[i] for i in group) for group in groups) == [
        list(range(first, first + 5)) for first in range(0, 1000, 5)
    ]
