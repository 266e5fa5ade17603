"""What the flows of Hairline have in common, as Prefect runs them."""

from collections.abc import Callable
from typing import ParamSpec, TypeVar

from prefect import Flow, flow

from flows.dead_runs import note_process
from flows.workers import one_a_core

P = ParamSpec("P")
R = TypeVar("R")


def inspection_flow(name: str, description: str | None) -> Callable[[Callable[P, R]], Flow[P, R]]:
    """A flow whose results are kept by its stages alone, one stage a core, and whose process is known."""
    return flow(
        name=name,
        description=description,
        persist_result=False,
        task_runner=one_a_core(),
        on_running=[note_process],
    )
