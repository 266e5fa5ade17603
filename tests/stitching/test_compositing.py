"""Photos that threads share while tiles are made, and that tiles are one mosaic."""

import threading
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
import pytest

from schemas.problem import BadInput
from tasks.stitching import compositing
from tasks.stitching.canvas import Canvas
from tasks.stitching.compositing import PhotoCache, Sizes, _boxes, composite
from tasks.stitching.gain import Light
from tasks.stitching.seams import darkness
from tasks.stitching.view import rotation
from tests.stitching.test_blending import row_of_photos


def sizes(level: int) -> Sizes:
    """15 bytes."""
    return Sizes(np.full((2, 2, 3), level, np.uint8), np.full((1, 1, 3), level, np.uint8))


def test_a_photo_that_threads_ask_for_at_once_is_read_once() -> None:
    reads: list[int] = []
    together = threading.Barrier(4)

    def read(index: int) -> Sizes:
        reads.append(index)
        time.sleep(0.05)
        return sizes(index)

    cache = PhotoCache(read)

    def ask(index: int) -> int:
        together.wait()
        return int(cache(index).full[0, 0, 0])

    with ThreadPoolExecutor(4) as threads:
        assert list(threads.map(ask, (7, 7, 8, 7))) == [7, 7, 8, 7]
    assert sorted(reads) == [7, 8]


def test_the_least_lately_used_photo_goes_first(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(compositing, "CACHE_BYTES", 30)  # two photos
    reads: list[int] = []

    def read(index: int) -> Sizes:
        reads.append(index)
        return sizes(index)

    cache = PhotoCache(read)
    for index in (0, 1, 0, 2, 0, 1):
        cache(index)
    assert reads == [0, 1, 2, 1]


def test_all_who_wait_for_a_photo_hear_that_it_cannot_be_read() -> None:
    def read(index: int) -> Sizes:
        time.sleep(0.05)
        raise BadInput("a.jpg", "cannot be read", "Copy it again")

    cache = PhotoCache(read)
    with ThreadPoolExecutor(2) as threads:
        for asked in [threads.submit(cache, 0) for _ in range(2)]:
            with pytest.raises(BadInput, match=r"a\.jpg"):
                asked.result()


def test_boxes_hold_each_land_and_no_more() -> None:
    label = np.full((20, 30), -1, np.int32)
    assert list(_boxes(label)) == []
    label[3:7, 5:9] = 4
    label[10, 29] = 2
    label[6:12, 0:2] = 4
    assert dict(_boxes(label)) == {2: (29, 30, 10, 11), 4: (0, 9, 3, 12)}


def test_tiles_are_one_blend(monkeypatch: pytest.MonkeyPatch) -> None:
    """However large they are: tilted photos of unlike exposure and texture, each pixel to the last bit."""
    views, photos = row_of_photos()
    views = [replace(view, R=view.R @ rotation(np.array([0.2, 0.15, 0.1]))) for view in views]
    rng = np.random.default_rng(1)
    photos = [np.clip(p + rng.normal(0, 20, p.shape), 0, 255).astype(np.uint8) for p in photos]
    canvas = Canvas(left=-0.4, top=0.3, gsd=1 / 480, width_px=1100, height_px=290)
    light = Light(np.ones((len(views), 3)), np.zeros((len(views), 2)))
    dark = [darkness(p) for p in photos]
    found = []
    for tile_px in (128, 256, 1024):
        monkeypatch.setattr(compositing, "TILE_PX", tile_px)
        rgb, source = np.zeros((290, 1100, 3), np.uint8), np.zeros((290, 1100), np.uint16)
        worth = [1.0] * len(views)
        for tile in composite(canvas, views, worth, light, dark, photos.__getitem__, lambda _: None):
            window = slice(tile.y, tile.y + tile.rgb.shape[0]), slice(tile.x, tile.x + tile.rgb.shape[1])
            rgb[window], source[window] = tile.rgb, tile.source
        found.append((rgb, source))
    assert len(np.unique(found[0][1])) > 4
    for rgb, source in found[1:]:
        assert (source == found[0][1]).all()
        assert (rgb == found[0][0]).all()


def test_a_photo_shown_alone_is_shown_as_it_is() -> None:
    (view, *_), (photo, *_) = row_of_photos()
    sharp = np.random.default_rng(1).integers(50, 200, photo.shape).astype(np.uint8)
    canvas = Canvas(left=-239.5 / 480, top=179.5 / 480, gsd=1 / 480, width_px=480, height_px=360)
    light = Light(np.ones((1, 3)), np.zeros((1, 2)))
    (tile,) = composite(canvas, [view], [1.0], light, [darkness(sharp)], lambda _: sharp, lambda _: None)
    covered = tile.coverage > 0
    assert covered.mean() > 0.9
    assert np.abs(tile.rgb.astype(int) - sharp)[covered].max() <= 1
