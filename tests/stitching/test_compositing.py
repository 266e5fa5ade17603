"""Photos that threads share while tiles are made."""

import threading
import time
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from schemas.problem import BadInput
from tasks.stitching import compositing
from tasks.stitching.compositing import PhotoCache, Sizes, _boxes


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
