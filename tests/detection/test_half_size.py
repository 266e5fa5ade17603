import cv2
import numpy as np

from schemas.bit_mask import BitMask
from schemas.raster import ArrayRaster
from tasks.connected import Marked
from tasks.detection.half_size import HalfSize, seen_at_half_size


def test_an_image_at_half_its_size_is_the_same_read_whole_or_in_parts() -> None:
    rng = np.random.default_rng(4)
    rgb = rng.integers(0, 256, (61, 83, 3), dtype=np.uint8)
    known = rng.random((61, 83)) > 0.02
    half = HalfSize(ArrayRaster(rgb, known))
    assert (half.height_px, half.width_px) == (30, 41)
    whole = cv2.resize(rgb[:60, :82], (41, 30), interpolation=cv2.INTER_AREA)
    assert (half.rgb(0, 30, 0, 41) == whole).all()
    assert (half.rgb(7, 20, 11, 40) == whole[7:20, 11:40]).all()
    valid = half.valid(5, 9, 10, 20)
    assert valid[2, 3] == known[14:16, 26:28].all() and valid.shape == (4, 10)
    assert (~half.valid(0, 30, 0, 41)).sum() > (~known).sum() / 2


def test_what_is_wide_must_be_seen_at_half_the_size_and_what_is_thin_need_not() -> None:
    wide_seen, wide_unseen, thin_unseen = (np.zeros((200, 300), np.uint8) for _ in range(3))
    cv2.line(wide_seen, (10, 30), (280, 50), 1, 10)
    cv2.line(wide_unseen, (10, 90), (280, 130), 1, 10)
    cv2.line(thin_unseen, (150, 140), (160, 195), 1, 3)
    half = cv2.resize(wide_seen, (150, 100), interpolation=cv2.INTER_AREA)
    kept = seen_at_half_size(
        Marked.of(BitMask.of((wide_seen | wide_unseen | thin_unseen) > 0)), BitMask.of(half > 0)
    )
    assert (kept.mask.whole() == ((wide_seen | thin_unseen) > 0)).all()
