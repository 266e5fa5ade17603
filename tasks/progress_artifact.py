"""How far a stage has come, as the dashboard shows it: an artifact made at its first word, updated every two
seconds at most."""

import time
from typing import Any

from prefect.artifacts import create_progress_artifact, update_progress_artifact
from prefect.context import TaskRunContext


class ProgressArtifact:
    """Of one task run."""

    _of: dict[Any, "ProgressArtifact"] = {}  # noqa: RUF012  # one a task run, until it is done

    def __init__(self, name: str) -> None:
        self.artifact: Any = create_progress_artifact(progress=0.0, key=f"progress-{name}")
        self.last_s, self.shown = time.monotonic(), 0.0

    @classmethod
    def of(cls, context: TaskRunContext) -> "ProgressArtifact":
        if context.task_run.id not in cls._of:  # a task run lives in one thread
            cls._of[context.task_run.id] = cls(context.task.name)
        return cls._of[context.task_run.id]

    @classmethod
    def done(cls, context: TaskRunContext) -> None:
        """Not every stage says when it has come to its end: a flight ends between two waypoints."""
        shown = cls._of.pop(context.task_run.id, None)
        if shown is not None and shown.shown < 1.0:
            shown.show(1.0)

    def show(self, fraction: float) -> None:
        now = time.monotonic()
        if now - self.last_s > 2.0 or fraction >= 1.0:
            self.last_s, self.shown = now, fraction
            update_progress_artifact(self.artifact, progress=100.0 * min(fraction, 1.0))
