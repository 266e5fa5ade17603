"""The run that a stage belongs to: its folder, what is to be redone, who listens, and whether it is dry."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

from pydantic import TypeAdapter

from artifacts.whole_file import whole
from schemas.contract import Contract
from tasks.lineage import Lineage

Outcome = Literal["started", "progress", "noted", "ran", "cached", "failed", "broke", "will run"]


@dataclass(frozen=True)
class Event:
    """What happened to a stage: it failed where an input cannot be used, it broke where nobody foresaw it.
    `detail`: seconds it ran, why it will run, what failed, or what is to be known while it runs."""

    stage: str
    outcome: Outcome
    item: str = ""
    fraction: float = 0.0
    detail: str = ""


class KeyParts(Contract):
    """What a stage's key was made of: digests by module, and by input."""

    code: dict[str, str]
    inputs: dict[str, str]


RECORD = TypeAdapter(dict[str, KeyParts])


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
    last: dict[str, KeyParts] = field(default_factory=dict)  # "stage/item" → what its key was made of

    def record_path(self) -> Path | None:
        return self.folder / ".stages.json" if self.folder else None


_current: ContextVar[Run | None] = ContextVar("hairline_run", default=None)


def current() -> Run:
    return _current.get() or Run()


@contextmanager
def running(run: Run) -> Iterator[Run]:
    """Make `run` the current one; remember at its end what each stage's key was made of."""
    path = run.record_path()
    if path is not None:
        with suppress(OSError, ValueError):  # none yet, or damaged: it only says why a stage runs
            run.last = RECORD.validate_json(path.read_bytes())
    token = _current.set(run)
    try:
        yield run
    finally:
        _current.reset(token)
        if path is not None and not run.dry:
            path.parent.mkdir(parents=True, exist_ok=True)
            with whole(path) as temporary:
                temporary.write_bytes(RECORD.dump_json(run.last))
