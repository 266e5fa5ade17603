"""Progress told from a thread of its own: the vehicle must not wait for a dashboard."""

from collections.abc import Callable
from contextlib import suppress
from contextvars import copy_context
from queue import SimpleQueue
from threading import Thread
from types import TracebackType
from typing import Self

LAST_WORD_S = 5.0


class Teller:
    """Hands fractions (0..1) on to `tell`, the newest where it is slow. What fails in telling is no matter of
    the flight."""

    def __init__(self, tell: Callable[[float], None]) -> None:
        self._fractions: SimpleQueue[float | None] = SimpleQueue()
        self._thread = Thread(target=copy_context().run, args=(self._work, tell), daemon=True)

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._fractions.put(None)
        self._thread.join(LAST_WORD_S)

    def __call__(self, fraction: float) -> None:
        self._fractions.put(fraction)

    def _work(self, tell: Callable[[float], None]) -> None:
        while (fraction := self._fractions.get()) is not None:
            if self._fractions.empty():
                with suppress(Exception):
                    tell(fraction)
