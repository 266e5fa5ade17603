"""Memory that serves again is not touched for the first time again."""

import platform
import resource

import numpy as np
import pytest

from tasks.detection.heap import reused

BLOCK = 48 << 20


def first_touches() -> int:
    before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
    for _ in range(10):
        np.ones(BLOCK, np.uint8)
    return resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="only glibc is told to keep what is freed")
def test_blocks_serve_again_inside_and_the_next_time() -> None:
    outside = first_touches()
    with reused():
        first_touches()
        inside = first_touches()
    with reused():
        again = first_touches()
    assert inside < outside / 5 and again < outside / 5
