"""Memory that is used again. glibc gives every large block back to the system and asks for it anew; each page
of it is then touched for the first time, which took a third of the network's time (measured)."""

import ctypes
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import cache
from typing import Any

# Parameters of mallopt (malloc.h), and the usual number of blocks that are asked of the system one by one.
TRIM_THRESHOLD, MMAP_THRESHOLD, MMAP_MAX = -1, -3, -4
USUAL_MMAP_MAX, LARGE = 65_536, 32 << 20
ALL = 2**31 - 1


@contextmanager
def reused() -> Iterator[None]:
    """Blocks freed inside serve again inside, and in the next one. Elsewhere than with glibc: nothing."""
    mallopt = _mallopt()
    mallopt(TRIM_THRESHOLD, ALL)
    mallopt(MMAP_MAX, 0)
    try:
        yield
    finally:
        mallopt(MMAP_MAX, USUAL_MMAP_MAX)
        mallopt(MMAP_THRESHOLD, LARGE)  # where glibc's own adjustment ends, which stops once anything is set


def given_back() -> None:
    """Free memory goes back to the system, where what follows is of another kind."""
    with suppress(OSError, TypeError, AttributeError):
        ctypes.CDLL(None).malloc_trim(0)


@cache
def _mallopt() -> Any:
    try:
        return ctypes.CDLL(None).mallopt
    except (OSError, TypeError, AttributeError):  # Windows, macOS, musl
        return lambda parameter, value: 0
