import cv2
import numpy as np
import pytest

from schemas.bit_mask import BitMask
from tasks.measurement import skeleton
from tasks.measurement.skeleton import skeleton_pixels
from tasks.measurement.thickness import thickness_px


def wedge() -> np.ndarray:
    """From 2 px to 180 px thick, over 900 px."""
    mask = np.zeros((400, 1000), np.uint8)
    cv2.fillPoly(mask, [np.array([[50, 199], [950, 110], [950, 290], [50, 201]], np.int32)], 1)
    return mask > 0


def test_thickness_is_that_of_the_whole_mask_at_once() -> None:
    mask = wedge()
    path = np.column_stack([np.arange(60.0, 940.0), np.full(880, 200.0)])
    whole = 2 * cv2.distanceTransform(mask.astype(np.uint8), cv2.DIST_L2, 5)
    found = thickness_px(BitMask.of(mask), path)
    assert found == pytest.approx(whole[200, 60:940], abs=1e-4) and found.max() > 150


def test_a_mask_without_a_rim_is_as_thick_as_the_image_lets_see() -> None:
    assert thickness_px(BitMask(40, 50), np.array([[3.0, 4.0]])).tolist() == [0.0]
    full = BitMask.of(np.ones((40, 50), dtype=bool))
    assert thickness_px(full, np.array([[25.0, 20.0]]))[0] > 50


def test_a_large_component_is_thinned_tile_by_tile(monkeypatch: pytest.MonkeyPatch) -> None:
    """The same pixels but for a few, and in one piece."""
    rng = np.random.default_rng(3)
    mask = np.zeros((700, 900), np.uint8)
    for _ in range(6):
        y = 350 + np.cumsum(rng.normal(0, 2.0, 900))
        line = np.rint(np.column_stack([np.arange(900), y])).astype(np.int32)
        cv2.polylines(mask, [line], False, 1, int(rng.integers(2, 9)))
    whole = {*map(tuple, skeleton_pixels(BitMask.of(mask > 0)))}
    monkeypatch.setattr(skeleton, "TILE_PX", 100)
    monkeypatch.setattr(skeleton, "HALO_PX", 30)
    tiled = {*map(tuple, skeleton_pixels(BitMask.of(mask > 0)))}
    assert len(whole ^ tiled) <= 0.01 * len(whole)
    drawn = np.zeros(mask.shape, np.uint8)
    x, y = np.array(sorted(tiled)).astype(int).T
    drawn[y, x] = 1
    pieces = cv2.connectedComponents(drawn)[0] - 1
    assert pieces == cv2.connectedComponents(mask)[0] - 1
