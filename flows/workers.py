"""How many items of a mapped stage run at the same time: one a core, which also bounds the memory."""

import os
from typing import Any, cast

from prefect.futures import PrefectFuture
from prefect.task_runners import TaskRunner, ThreadPoolTaskRunner

CORES = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def one_a_core() -> TaskRunner[PrefectFuture[Any]]:
    runner = ThreadPoolTaskRunner[Any](max_workers=CORES)
    return cast(TaskRunner[PrefectFuture[Any]], runner)  # Prefect declares its own runners too narrowly
