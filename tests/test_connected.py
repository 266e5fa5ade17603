"""Components of images that are looked at band by band, beside OpenCV's of the whole."""

import cv2
import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from schemas.bit_mask import BitMask
from tasks.connected import Marked, at_least, connected, highest_near, regions


def blotches(seed: int, height: int = 1400, width: int = 90) -> np.ndarray:
    noise = np.random.default_rng(seed).random((height, width)).astype(np.float32)
    return cv2.GaussianBlur(noise, (0, 0), 3.0) > 0.5


@given(st.integers(0, 999))
@settings(max_examples=10)
def test_labels_are_those_of_the_whole_image_in_the_order_of_first_pixels(seed: int) -> None:
    mask = blotches(seed)
    count, labels = cv2.connectedComponents(mask.astype(np.uint8), connectivity=8)
    pixels = Marked.of(BitMask.of(mask))
    label, found = connected(pixels)
    assert found == count - 1
    theirs = labels[pixels.y, pixels.x]
    assert len({*zip(theirs.tolist(), label.tolist(), strict=True)}) == found  # one to one
    first = np.unique(label, return_index=True)[1]
    assert (np.diff(first) > 0).all() and label[0] == 1


@given(st.integers(0, 999), st.integers(1, 6))
@settings(max_examples=10)
def test_what_a_gap_lies_between_hangs_together_as_when_all_is_grown(seed: int, reach_px: int) -> None:
    mask = np.random.default_rng(seed).random((1400, 90)) < 0.01
    grown = cv2.dilate(mask.astype(np.uint8), np.ones((2 * reach_px + 1,) * 2, np.uint8))
    count, labels = cv2.connectedComponents(grown, connectivity=8)
    pixels = Marked.of(BitMask.of(mask))
    label, found = connected(pixels, reach_px)
    theirs = labels[pixels.y, pixels.x]
    assert found == count - 1
    assert len({*zip(theirs.tolist(), label.tolist(), strict=True)}) == found  # one to one


@given(st.integers(0, 999))
@settings(max_examples=10)
def test_regions_have_the_same_areas_and_pixels(seed: int) -> None:
    mask = blotches(seed)
    count, labels, stats, _ = cv2.connectedComponentsWithStats(mask.astype(np.uint8), connectivity=8)
    found = regions(BitMask.of(mask))
    assert sorted(found.area_px[1:]) == sorted(stats[1:, cv2.CC_STAT_AREA])
    chosen = found.area_px >= np.median(found.area_px[1:])
    chosen[0] = False
    ours = {(labels[y[0], x[0]], len(y)) for y, x in found.pixels(chosen)}
    least = np.median(found.area_px[1:])
    assert ours == {
        (n, stats[n, cv2.CC_STAT_AREA]) for n in range(1, count) if stats[n, cv2.CC_STAT_AREA] >= least
    }
    assert all((labels[y, x] == labels[y[0], x[0]]).all() for y, x in found.pixels(chosen))


def test_nothing_set_has_no_components() -> None:
    empty = BitMask(700, 30)
    assert connected(Marked.of(empty))[1] == 0
    found = regions(empty)
    assert found.area_px.tolist() == [0] and list(found.pixels(np.zeros(1, bool))) == []


def test_levels_stay_with_their_pixels_whatever_the_order_of_the_windows() -> None:
    levels = np.random.default_rng(1).integers(0, 3, (20, 30)).astype(np.uint8)
    parts = [
        at_least(1, levels[a : a + 7, b : b + 11], a, b) for b in range(0, 30, 11) for a in range(0, 20, 7)
    ]
    assert all(
        (one == other).all()
        for one, other in zip(Marked.gathered(20, 30, parts)[2:], Marked.of_levels(levels)[2:], strict=True)
    )


@given(st.integers(0, 999), st.integers(0, 6))
@settings(max_examples=10)
def test_the_highest_nearby_is_that_of_the_whole_image(seed: int, reach_px: int) -> None:
    rng = np.random.default_rng(seed)
    levels = np.where(rng.random((1400, 90)) < 0.05, rng.integers(1, 256, (1400, 90)), 0).astype(np.uint8)
    highest = cv2.dilate(levels, np.ones((2 * reach_px + 1,) * 2, np.uint8))
    pixels = Marked.of_levels(levels)
    assert (highest_near(pixels, reach_px) == highest[pixels.y, pixels.x]).all()
