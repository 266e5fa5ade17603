"""Directions and descriptors: of a slope that is known, and of a picture that is turned and brightened."""

import cv2
import numpy as np
import pytest

from tasks.photos.descriptors import _angle, described
from tasks.photos.scale_space import Octave, Points, extrema, octaves
from tests.photos.test_sift import texture

FIRST = np.zeros(1, np.int32)
MIDDLE = Points(np.array([150.0]), np.array([150.0]), FIRST, np.array([1.0]), np.array([0.1]))


def space(grey: np.ndarray) -> list[Octave]:
    return octaves(grey.astype(np.float32), 1.0)


@pytest.mark.parametrize("degrees", [0, 10, 95, 200, 341])
def test_a_slope_has_the_direction_in_which_it_brightens(degrees: float) -> None:
    y, x = np.mgrid[:301, :301]
    grey = 0.3 * (x * np.cos(np.radians(degrees)) + y * np.sin(np.radians(degrees)))
    index, angle, descriptors = described(space(grey), MIDDLE, 10)
    assert index.tolist() == [0]
    assert np.degrees(angle[0]) % 360 == pytest.approx(degrees, abs=0.5)
    assert np.linalg.norm(descriptors[0]) == pytest.approx(1.0, abs=1e-5)
    by_bin = descriptors[0].reshape(16, 8).sum(axis=0)
    assert by_bin[0] > 0.97 * by_bin.sum()  # all of it along its own direction


def test_a_turned_and_brighter_picture_looks_the_same() -> None:
    grey = cv2.GaussianBlur(texture(301, 301), (0, 0), 2.0).astype(np.float64)
    points = extrema(space(grey), 0.01)
    inside = np.flatnonzero(np.hypot(points.x - 150, points.y - 150) + 8 * points.sigma < 150)
    points = points.where(inside[np.argsort(-points.response[inside])][:60])
    turned = cv2.warpAffine(
        grey, cv2.getRotationMatrix2D((150, 150), -30, 1.0), (301, 301), flags=cv2.INTER_CUBIC
    )
    c, s = np.cos(np.radians(30)), np.sin(np.radians(30))
    x, y = points.x - 150, points.y - 150
    moved = points._replace(x=150 + c * x - s * y, y=150 + s * x + c * y)
    before, angle, own = described(space(grey), points, 200)
    after, angle_after, theirs = described(space(0.8 * turned + 20), moved, 200)
    alike = own @ theirs.T
    same = before[:, None] == after[None, :]
    best = np.where(same, alike, -1).max(axis=1)
    assert np.median(best) > 0.97
    assert np.median(np.where(same, -1, alike).max(axis=1)) < 0.9
    k = np.where(same, alike, -1).argmax(axis=1)
    off = np.degrees(np.angle(np.exp(1j * (angle_after[k] - angle - np.radians(30)))))
    assert np.median(np.abs(off)) < 1.0


def test_descriptors_are_those_of_opencv() -> None:
    """Whose directions go the other way round."""
    grey = cv2.GaussianBlur(texture(301, 301), (0, 0), 2.0)
    points = extrema(space(grey), 0.01)
    index, angle, ours = described(space(grey), points, 300)
    at = points.where(index)
    keypoints = [
        cv2.KeyPoint(x, y, 2 * sigma, np.degrees(turn) % 360, response, int(octave) + (round(layer) << 8))
        for x, y, sigma, turn, response, octave, layer in zip(
            at.x, at.y, at.sigma, angle, at.response, at.octave, at.layer, strict=True
        )
    ]
    _, theirs = cv2.SIFT.create().compute(grey, keypoints)
    theirs = theirs.reshape(-1, 16, 8)[:, :, [0, 7, 6, 5, 4, 3, 2, 1]].reshape(-1, 128)
    alike = (ours * theirs).sum(axis=1) / np.linalg.norm(theirs, axis=1)
    assert len(alike) > 100 and np.median(alike) > 0.99 and np.percentile(alike, 2) > 0.95


def test_the_strongest_points_come_first_and_no_more_than_asked_for() -> None:
    grey = cv2.GaussianBlur(texture(301, 301), (0, 0), 2.0)
    points = extrema(space(grey), 0.002)
    index, angle, descriptors = described(space(grey), points, 30)
    assert len(index) == len(angle) == len(descriptors) == 30
    assert (np.diff(index) >= 0).all() and index[0] == 0


def test_points_at_the_rim_are_described_by_what_there_is() -> None:
    grey = texture(301, 301)
    rim = Points(*(np.array(n, float) for n in ([5.0, 295.0], [5.0, 295.0], [0, 0], [3.4, 0.6], [0.1, 0.1])))
    _, _, descriptors = described(space(grey), rim._replace(octave=np.zeros(2, np.int32)), 10)
    assert np.isfinite(descriptors).all() and (descriptors >= 0).all()
    assert np.linalg.norm(descriptors, axis=1) == pytest.approx(1.0, abs=1e-5)


def test_angles_are_those_of_atan2() -> None:
    turn = np.linspace(-3.1, 3.1, 501)
    ours = np.array([_angle(np.float32(np.sin(t)), np.float32(np.cos(t))) for t in turn])
    assert ours == pytest.approx(turn, abs=3e-4)
    assert _angle(np.float32(0), np.float32(0)) == 0.0
