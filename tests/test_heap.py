"""Memory that serves again is not touched for the first time again."""

import platform
import subprocess
import sys

import pytest

PROGRAM = """
import resource
import numpy as np
from tasks.heap import reused

def first_touches():
    before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
    for _ in range(10):
        np.ones(48 << 20, np.uint8)
    return resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before

print(first_touches())
with reused():
    first_touches()
    print(first_touches())
with reused():
    print(first_touches())
"""


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="only glibc is told to keep what is freed")
def test_blocks_serve_again_inside_and_the_next_time() -> None:
    """In a process of its own: what others did with its memory would count."""
    told = subprocess.run([sys.executable, "-c", PROGRAM], check=True, capture_output=True, text=True)
    before, inside, again = (int(count) for count in told.stdout.split())
    assert inside < before / 5 and again < before / 5
