"""Features: found again in a moved photo, spread over it, the same bytes each time, at a bounded cost."""

import time
from pathlib import Path

import cv2
import numpy as np

from artifacts.store import digest
from schemas.camera import Camera
from tasks.photos.sift import UNIT, _root, detect_features, write_features


def texture(width: int, height: int, contrast: float = 12.0, seed: int = 0) -> np.ndarray:
    rng = np.random.default_rng(seed)
    grey = np.zeros((height, width), np.float32)
    for k in range(7):
        coarse = rng.standard_normal((height // 2**k + 2, width // 2**k + 2)).astype(np.float32)
        grey += cv2.resize(coarse, (width, height), interpolation=cv2.INTER_CUBIC) * 1.5**k
    grey += 0.1 * grey.std()
    return np.clip(120 + contrast * grey / grey.std(), 0, 255).astype(np.uint8)


def camera(grey: np.ndarray, k1: float = 0.0) -> Camera:
    return Camera(width_px=grey.shape[1], height_px=grey.shape[0], focal_px=2000.0, k1=k1)


def test_points_are_found_within_a_tenth_of_a_pixel_and_without_bias() -> None:
    """The same texture half a pixel to the right and a third down; 2 MP, so features come from a copy."""
    fine = texture(1632, 1224)
    moved = cv2.warpAffine(
        fine, np.array([[1, 0, 0.5], [0, 1, 1 / 3]]), (1632, 1224), flags=cv2.INTER_LANCZOS4
    )
    a, b = detect_features(fine, camera(fine), 2000), detect_features(moved, camera(moved), 2000)
    nearest = (a.descriptors.astype(np.float32) @ b.descriptors.astype(np.float32).T).argmax(axis=1)
    shift = b.xy[nearest] - a.xy
    close = np.linalg.norm(shift - [0.5, 1 / 3], axis=1) < 2.0
    assert close.mean() > 0.8
    assert np.abs(np.median(shift[close], axis=0) - [0.5, 1 / 3]).max() < 0.02
    assert np.median(np.linalg.norm(shift[close] - [0.5, 1 / 3], axis=1)) < 0.15


def test_a_flipped_photo_has_flipped_points() -> None:
    """No bias towards a corner: a photo turned by 180° gives the same points turned."""
    fine = texture(816, 612)
    turned = np.ascontiguousarray(fine[::-1, ::-1])
    a, b = detect_features(fine, camera(fine), 1500), detect_features(turned, camera(fine), 1500)
    nearest = (a.descriptors.astype(np.float32) @ b.descriptors.astype(np.float32).T).argmax(axis=1)
    off = (np.array([815.0, 611.0]) - b.xy[nearest]) - a.xy
    close = np.linalg.norm(off, axis=1) < 1.0
    assert close.mean() > 0.8
    assert np.abs(off[close].mean(axis=0)).max() < 0.02


def test_points_are_undistorted() -> None:
    fine = texture(816, 612)
    straight, bent = (
        detect_features(fine, camera(fine), 500),
        detect_features(fine, camera(fine, k1=-0.1), 500),
    )
    again = camera(fine, k1=-0.1)
    ideal = (bent.xy - np.array(again.principal_px)) / again.focal_px
    back = again.distort(ideal) * again.focal_px + again.principal_px
    np.testing.assert_allclose(back, straight.xy, atol=1e-3)
    assert np.abs(bent.xy - straight.xy).max() > 1.0


def test_features_are_spread_even_where_one_corner_has_all_the_contrast() -> None:
    grey = texture(1632, 1224, contrast=8.0)
    grey[:306, :408] = texture(408, 306, contrast=40.0)
    found = detect_features(grey, camera(grey), 1000)
    assert len(found.xy) == 1000
    in_corner = ((found.xy < [408, 306]).all(axis=1)).mean()
    assert in_corner < 0.15  # the corner is 1/16 of the photo


def test_fair_faced_concrete_has_features_and_one_grey_has_none() -> None:
    rng = np.random.default_rng(3)
    faint = np.clip(np.rint(texture(816, 612, contrast=3.0) + rng.normal(0, 1.5, (612, 816))), 0, 255)
    assert len(detect_features(faint.astype(np.uint8), camera(faint), 2000).xy) > 500
    for blank in (np.full((612, 816), 128, np.uint8), np.full((1, 1), 9, np.uint8)):
        assert len(detect_features(blank, camera(blank), 2000).xy) == 0


def test_what_rounding_leaves_below_zero_is_nothing() -> None:
    """One photo in ninety has such a number; its root was a warning."""
    described = np.zeros((1, 128), np.float32)
    described[0, :11] = -1.2e-9, *[0.1] * 10
    root = _root(described)[0]
    assert root[0] == 0 and (root[1:11] == round(UNIT * 0.1**0.5)).all() and root[11:].max() == 0


def test_same_photo_same_bytes(tmp_path: Path) -> None:
    grey = texture(816, 612)
    before = cv2.getNumThreads()
    digests = set()
    for threads in (1, 2):
        cv2.setNumThreads(threads)
        path = tmp_path / f"{threads}.npz"
        write_features(detect_features(grey, camera(grey), 1000), path)
        digests.add(digest(path))
    cv2.setNumThreads(before)
    assert len(digests) == 1


def test_large_photos_cost_little_more_than_small_ones() -> None:
    seconds = []
    for width, height in ((1632, 1224), (5472, 3648)):
        grey = texture(width, height)
        start = time.process_time()
        detect_features(grey, camera(grey), 2000)
        seconds.append(time.process_time() - start)
    assert seconds[1] < 3.0 * seconds[0] + 0.5
