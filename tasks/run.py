"""The run that a stage belongs to: its folder, what is to be redone, who listens, and whether it is dry."""

import json
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

from tasks.lineage import Lineage

Outcome = Literal["started", "progress", "noted", "ran", "cached", "failed", "will run"]


@dataclass(frozen=True)
class Event:
    """What happened to a stage. `detail`: seconds it ran, why it will run, what failed, or what is
    to be known while it runs."""

    stage: str
    outcome: Outcome
    item: str = ""
    fraction: float = 0.0
    detail: str = ""


def _nobody_listens(event: Event) -> None:
    pass


@dataclass
class Run:
    folder: Path | None = None  # runs/<inspection>; None: a command without a run folder
    redo: dict[str, str] = field(default_factory=dict)  # stage → token that is part of its key
    listener: Callable[[Event], None] = _nobody_listens
    dry: bool = False  # look stages up, run none
    lay_out: bool = True  # give results their readable names in the folder
    lineage: Lineage = field(default_factory=Lineage)  # of this run's results
    last: dict[str, Any] = field(default_factory=dict)  # "stage/item" → what its key was made of

    def record_path(self) -> Path | None:
        return self.folder / ".stages.json" if self.folder else None


_current: ContextVar[Run | None] = ContextVar("hairline_run", default=None)


def current() -> Run:
    return _current.get() or Run()


@contextmanager
def running(run: Run) -> Iterator[Run]:
    """Make `run` the current one; remember at its end what each stage's key was made of."""
    path = run.record_path()
    if path is not None and path.is_file():
        run.last = json.loads(path.read_text())
    token = _current.set(run)
    try:
        yield run
    finally:
        _current.reset(token)
        if path is not None and not run.dry:
            path.parent.mkdir(parents=True, exist_ok=True)
            temporary = path.with_suffix(".tmp")
            temporary.write_text(json.dumps(run.last))
            temporary.replace(path)
