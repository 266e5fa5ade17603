"""What is said of photos that their matches do not hold."""

import numpy as np
import pytest

from schemas.camera import Camera
from tasks.stitching.pairs import PhotoFeatures
from tasks.stitching.placement import STRONG, TEXTURED, fates
from tasks.stitching.prior import PlaneFrame, Prior
from tasks.stitching.view import FACING, View

CAMERA = Camera(width_px=1200, height_px=900, focal_px=1000.0)


def features(strong: int) -> PhotoFeatures:
    nothing = np.zeros((strong, 2), np.float32)
    response = np.full(strong, 2 * STRONG, np.float32)
    return PhotoFeatures(nothing, nothing[:, 0], response, np.zeros((strong, 128), np.uint8))


@pytest.mark.parametrize(
    ("strong", "why"), [(TEXTURED, "no match with another photo"), (TEXTURED - 1, "too little texture")]
)
def test_a_photo_full_of_texture_is_not_said_to_lack_it(strong: int, why: str) -> None:
    """Positions known to 5 m do not tell whether it overlaps the solved ones: it is placed all the same."""
    views = [View(CAMERA, FACING, np.array([2.0 * k, 0.0, 5.0])) for k in range(3)]
    priors = tuple(Prior(view, np.full(3, 5.0), np.radians(np.full(3, 2.0))) for view in views)
    frame = PlaneFrame(None, "GPS", priors, np.zeros(3))
    found = fates(frame, dict(enumerate(views[:2])), [features(TEXTURED)] * 2 + [features(strong)])
    assert [fate.status for fate in found] == ["solved", "solved", "placed"]
    assert "± 5.00 m" in found[2].reason
    assert why in found[2].reason
