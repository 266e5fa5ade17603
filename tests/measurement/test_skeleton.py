import cv2
import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from schemas.bit_mask import BitMask
from tasks.measurement.centreline import arc_length, orientation_deg, resample, simplify, smooth
from tasks.measurement.skeleton import Path
from tasks.measurement.skeleton import crack_paths as of_bits


def strokes(*lines: tuple[tuple[int, int], tuple[int, int]], thickness: int = 3) -> np.ndarray:
    mask = np.zeros((300, 400), np.uint8)
    for a, b in lines:
        cv2.line(mask, a, b, 1, thickness)
    return mask > 0


def crack_paths(mask: np.ndarray, least_px: float, gap_px: float) -> list[Path]:
    return of_bits(BitMask.of(mask), least_px, gap_px)


def length(points: np.ndarray) -> float:
    return float(arc_length(smooth(points))[-1])


@settings(max_examples=30)
@given(st.floats(0, 2 * np.pi), st.floats(60, 130), st.integers(1, 7))
@example(0.75, 60.0, 3)
def test_length_of_a_stroke_in_any_direction(direction: float, half: float, thickness: int) -> None:
    ends = [
        (round(200 + s * half * np.cos(direction)), round(150 + s * half * np.sin(direction)))
        for s in (-1, 1)
    ]
    paths = crack_paths(strokes((ends[0], ends[1]), thickness=thickness), 30, 0)
    assert len(paths) == 1
    assert length(paths[0].points) == pytest.approx(2 * half, abs=thickness + 3)


def test_a_fork_is_a_crack_and_its_branch() -> None:
    paths = crack_paths(
        strokes(((20, 150), (200, 150)), ((200, 150), (380, 80)), ((200, 150), (300, 250))), 30, 0
    )
    assert len(paths) == 2 and paths[0].network == paths[1].network
    lengths = sorted(length(p.points) for p in paths)
    assert lengths == pytest.approx([141, 373], abs=8)


def test_spurs_are_left_out() -> None:
    paths = crack_paths(
        strokes(((20, 150), (380, 150)), ((100, 150), (106, 138)), ((250, 150), (250, 162))), 30, 0
    )
    assert len(paths) == 1 and length(paths[0].points) == pytest.approx(360, abs=5)


def test_a_loop_is_not_lost() -> None:
    ring = cv2.circle(np.zeros((300, 400), np.uint8), (200, 150), 80, 1, 3) > 0
    paths = crack_paths(ring, 30, 0)
    assert sum(length(p.points) for p in paths) == pytest.approx(2 * np.pi * 80, rel=0.05)


def test_gaps_are_bridged_only_straight_ahead() -> None:
    ahead = strokes(((20, 150), (180, 150)), ((190, 152), (380, 150)))
    assert len(crack_paths(ahead, 30, 15)) == 1
    aside = strokes(((20, 150), (180, 150)), ((180, 162), (180, 290)))
    assert len(crack_paths(aside, 30, 15)) == 2
    assert len({p.network for p in crack_paths(aside, 30, 15)}) == 2


def test_a_branch_in_pieces_is_as_long_as_all_of_it() -> None:
    """131 px from the main crack on, of which little more than half is seen."""
    mask = np.zeros((400, 400), bool)
    mask[10:390, 100] = mask[200, 101:115] = mask[200, 154:174] = mask[200, 213:233] = True
    assert [round(length(p.points), -1) for p in crack_paths(mask, 100, 40)] == [380, 130]


@settings(max_examples=50)
@given(st.floats(0, 179.99), st.floats(5, 500))
def test_orientation_of_a_line(direction: float, size: float) -> None:
    t = np.linspace(-size, size, 50)
    points = np.column_stack([t * np.cos(np.radians(direction)), -t * np.sin(np.radians(direction))])
    apart = abs(orientation_deg(points + 100.0) - direction)
    assert min(apart, 180 - apart) < 1e-6
    assert 0.0 <= orientation_deg(points) < 180.0


def test_simplified_lines_stay_near() -> None:
    x = np.linspace(0, 300, 301)
    points = np.column_stack([x, 10 * np.sin(x / 20)])
    fewer = simplify(points, 0.25)
    assert len(fewer) < 80
    assert np.abs(np.interp(x, fewer[:, 0], fewer[:, 1]) - points[:, 1]).max() < 0.3


def test_resampled_lines_keep_length_and_ends() -> None:
    points = np.array([[0.0, 0.0], [30.0, 40.0], [30.0, 140.0]])
    even = resample(points, 1.0)
    assert len(even) == 151 and (even[[0, -1]] == points[[0, -1]]).all()
    assert np.diff(arc_length(even)).max() <= 1.0 + 1e-9
