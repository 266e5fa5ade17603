"""@stage: what makes the DAG typed, cached, resumable and retriable.

A stage is a function from schemas to a schema. Decorated, it is
- checked: inputs and output are validated against the annotations on every call;
- cached: its key is its name, its code and the content of its inputs (tasks/content_key.py), and a result
  whose files are lost or altered is a miss;
- shown: its pages become artifacts of the dashboard, on cache hits too, and its progress is told;
- retriable: once more after an unforeseen failure, never after a BadInput.

`stage.bare(…)` is the checked function without Prefect.
"""

import inspect
import json
import time
import traceback
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict
from functools import cached_property
from pathlib import Path
from typing import Any, Generic, ParamSpec, TypeVar, cast
from uuid import UUID

from prefect import Task, task
from prefect._internal.result_records import ResultRecord
from prefect.artifacts import (
    create_link_artifact,
    create_markdown_artifact,
    create_table_artifact,
)
from prefect.cache_policies import CacheKeyFnPolicy
from prefect.client.schemas.objects import State, TaskRun
from prefect.context import TaskRunContext
from prefect.futures import PrefectFuture, PrefectTaskRunFuture
from prefect.serializers import JSONSerializer, prefect_json_object_decoder
from prefect.states import Completed
from prefect.utilities.annotations import quote
from pydantic import ConfigDict, validate_call

from artifacts import store
from artifacts.page import Page
from artifacts.whole_file import whole
from schemas.file import File
from schemas.problem import BadInput
from tasks import run
from tasks.content_key import content_key, digest_code, digest_inputs, digest_of_look
from tasks.progress_artifact import ProgressArtifact
from tasks.run import Event, KeyParts

P = ParamSpec("P")
R = TypeVar("R")
Pages = Callable[[Mapping[str, Any], Any], Sequence[Page]]


STAGES: dict[str, "Stage[Any, Any]"] = {}  # by name; a stage is here once its task.py is imported


class NotYetKnown(Exception):
    """In a dry run: a flow looked into the result of a stage that has yet to run."""


class Pending:
    """In a dry run: the result of a stage that has yet to run."""

    def __init__(self, stage: str) -> None:
        self._stage = stage

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):  # protocol probes (pydantic, copy) are not looks into the result
            raise AttributeError(name)
        raise NotYetKnown(self._stage)

    def __iter__(self) -> Any:
        raise NotYetKnown(self._stage)


class Stage(Generic[P, R]):
    def __init__(
        self, function: Callable[P, R], unkeyed: tuple[str, ...], pages: Pages | None, effects: bool
    ) -> None:
        self.name = function.__name__
        self.module = function.__module__
        self.unkeyed = unkeyed
        self.pages = pages
        self.effects = effects
        self.signature = inspect.signature(function)
        self.__doc__ = function.__doc__
        self._seconds: dict[UUID, float] = {}  # task run → how long its body took
        checked = validate_call(config=ConfigDict(arbitrary_types_allowed=True), validate_return=True)
        self.bare: Callable[P, R] = checked(function)

    # -- as a Prefect task ---------------------------------------------------------------------------

    @cached_property
    def task(self) -> Task[P, R]:
        return task(
            name=self.name.replace("_", "-"),
            description=(self.__doc__ or "").strip(),
            task_run_name=self._run_name,
            cache_policy=CacheKeyFnPolicy(
                cache_key_fn=lambda _, inputs: self.key(self.named_inputs((), inputs))
            ),
            persist_result=True,
            result_serializer=JSONSerializer(object_decoder="tasks.stage.decode_verified"),
            retries=0 if self.effects else 1,
            retry_condition_fn=lambda _task, _run, state: not isinstance(failure(state), BadInput),
            on_completion=[self._on_completion],
            on_failure=[self._on_failure],
        )(self._as_task_body())

    def __call__(self, *args: P.args, **kwargs: P.kwargs) -> R:
        """Run as a task of the flow that runs now; in a dry run only look the result up."""
        inputs = self.named_inputs(args, kwargs)
        if run.current().dry:
            return cast(R, self._look_up(inputs))
        parents = _parents(inputs)
        state = self._stored_task()(**_quoted(inputs), wait_for=parents, return_state=True)
        result = state.result()
        run.current().lineage.leave(result, state.state_details.task_run_id)
        return result

    def each(self, calls: Iterable[Sequence[Any]]) -> list[R | BadInput]:
        """Run once for each tuple of arguments, at the same time; an unusable item gives its BadInput."""
        inputs = [self.named_inputs(tuple(call), {}) for call in calls]
        if run.current().dry:
            return [cast(R, self._look_up(one)) for one in inputs]
        stored = self._stored_task()
        futures = [stored.submit(**_quoted(one), wait_for=_parents(one)) for one in inputs]
        results: list[R | BadInput] = []
        for future in futures:
            future.wait()
            problem = failure(future.state)
            if problem is not None and not isinstance(problem, BadInput):
                raise problem
            results.append(problem or future.result())
            run.current().lineage.leave(results[-1], future.task_run_id)
        return results

    # -- key and cache -------------------------------------------------------------------------------

    def named_inputs(self, args: tuple[Any, ...], kwargs: Mapping[str, Any]) -> dict[str, Any]:
        bound = self.signature.bind(*args, **kwargs)
        bound.apply_defaults()
        return dict(bound.arguments)

    def _key_parts(self, inputs: Mapping[str, Any]) -> tuple[dict[str, str], dict[str, str]]:
        keyed = {name: value for name, value in inputs.items() if name not in self.unkeyed}
        return ({} if self.effects else digest_code(self.module)), digest_inputs(keyed)

    def key(self, inputs: Mapping[str, Any]) -> str:
        code, digests = self._key_parts(inputs)
        return content_key(self.name, code, digests, run.current().redo.get(self.name))

    def cached(self, inputs: Mapping[str, Any]) -> R | None:
        """The stored result of these inputs, if it is there and all its files are unaltered."""
        try:
            content = (_results() / self.key(inputs)).read_bytes()
            return cast(R, ResultRecord.deserialize(content).result)
        except (OSError, ValueError):
            return None

    def is_cached(self, *args: P.args, **kwargs: P.kwargs) -> bool:
        return self.cached(self.named_inputs(args, kwargs)) is not None

    def _look_up(self, inputs: Mapping[str, Any]) -> R | Pending:
        result = None
        pending = [value for value in inputs.values() if _has_pending(value)]
        if not pending:
            result = self.cached(inputs)
        item = item_name(inputs)
        if result is not None:
            _tell(Event(self.name, "cached", item))
            return result
        why = "an earlier stage will run" if pending else self._what_changed(inputs)
        _tell(Event(self.name, "will run", item, detail=why))
        return Pending(self.name)

    def _what_changed(self, inputs: Mapping[str, Any]) -> str:
        code, digests = self._key_parts(inputs)
        last = run.current().last.get(f"{self.name}/{item_name(inputs)}")
        if run.current().redo.get(self.name):
            return "to be redone"
        if last is None:
            return "has not run yet"
        changed = [f"{name} edited" for name in _differences(last.code, code)]
        changed += [f"{name} changed" for name in _differences(last.inputs, digests)]
        return ", ".join(changed) or "its stored result is lost or altered"

    # -- hooks ---------------------------------------------------------------------------------------

    def _stored_task(self) -> Task[P, R]:
        return self.task.with_options(result_storage=_results())

    def _as_task_body(self) -> Callable[P, R]:
        """The checked function, telling when it starts; Prefect reads its name and signature off it."""

        def body(*args: Any, **kwargs: Any) -> Any:
            context, inputs = TaskRunContext.get(), self.named_inputs(args, kwargs)
            known = self.cached(inputs)  # Prefect takes any trouble in reading for a miss: look again
            if known is not None:
                return known
            _tell(Event(self.name, "started", item_name(inputs)))
            began_s = time.monotonic()
            result = self.bare(*args, **kwargs)
            if context is not None:
                self._seconds[context.task_run.id] = time.monotonic() - began_s
                ProgressArtifact.done(context)
            return result

        body.__name__, body.__module__, body.__doc__ = self.name, self.module, self.__doc__
        body.__signature__ = self.signature  # type: ignore[attr-defined]
        return cast(Callable[P, R], body)

    def _run_name(self) -> str:
        context = TaskRunContext.get()
        item = item_name(_parameters(context)) if context else ""
        return f"{self.name.replace('_', '-')} {item}".strip()

    def _on_completion(self, _task: Task[..., Any], task_run: TaskRun, state: State[Any]) -> None:
        context = TaskRunContext.get()
        inputs = self.named_inputs((), _parameters(context)) if context else {}
        item = item_name(inputs)
        code, digests = self._key_parts(inputs)
        run.current().last[f"{self.name}/{item}"] = KeyParts(code=code, inputs=digests)
        for page in self._drawn_pages(inputs, state):
            publish(page)
        seconds = self._seconds.pop(task_run.id, None)
        if seconds is None:
            _tell(Event(self.name, "cached", item))
        else:
            _tell(Event(self.name, "ran", item, 1.0, f"{seconds:.1f} s"))

    def _drawn_pages(self, inputs: Mapping[str, Any], state: State[Any]) -> Sequence[Page]:
        """The result's pages, kept beside it: drawing their pictures takes longer than all else of a hit."""
        if self.pages is None:
            return ()
        path = store.current().root / "pages" / f"{self.key(inputs)}-{digest_of_look()}.json"
        with suppress(OSError, ValueError, TypeError):
            return [Page(**page) for page in json.loads(path.read_bytes())]
        pages = self.pages(inputs, state.result())
        path.parent.mkdir(parents=True, exist_ok=True)
        with whole(path) as temporary:
            temporary.write_text(json.dumps([asdict(page) for page in pages]))
        return pages

    def _on_failure(self, _task: Task[..., Any], task_run: TaskRun, state: State[Any]) -> None:
        context = TaskRunContext.get()
        problem = failure(state)
        item = item_name(_parameters(context) if context else {})
        if isinstance(problem, BadInput):
            _tell(Event(self.name, "failed", item, detail=str(problem)))
        else:
            _tell(Event(self.name, "broke", item, detail=_one_line(problem)))


def stage(
    *, unkeyed: tuple[str, ...] = (), pages: Pages | None = None, effects: bool = False
) -> Callable[[Callable[P, R]], Stage[P, R]]:
    """Make a stage of a function.

    unkeyed: inputs that cannot change the result (a connection, a number of workers, an output path).
    pages:   what to show of inputs and result in the dashboard.
    effects: the stage acts on the world (flies): keyed by its inputs alone, not by its code, and never
             retried by itself.
    """

    def decorate(function: Callable[P, R]) -> Stage[P, R]:
        STAGES[function.__name__] = Stage(function, unkeyed, pages, effects)
        return cast(Stage[P, R], STAGES[function.__name__])

    return decorate


def progress(fraction: float) -> None:
    """Say how far the running stage has come (0..1); shown in the terminal and in the dashboard."""
    context = TaskRunContext.get()
    if context is None:
        _tell(Event("", "progress", fraction=fraction))
        return
    name = context.task.name.replace("-", "_")
    _tell(Event(name, "progress", item_name(_parameters(context)), fraction))
    ProgressArtifact.of(context).show(fraction)


def note(text: str) -> None:
    """Say something that people should know while the stage still runs; shown in the terminal."""
    context = TaskRunContext.get()
    _tell(Event(context.task.name.replace("-", "_") if context else "", "noted", detail=text))


def publish(page: Page) -> None:
    """Make an artifact of a page, attached to the task or flow that runs now."""
    if page.markdown is not None:
        create_markdown_artifact(page.markdown, key=page.key, description=page.description)
    elif page.link is not None:
        create_link_artifact(page.link, key=page.key, description=page.description)
    else:
        create_table_artifact(page.table, key=page.key, description=page.description)


class _Parent(PrefectTaskRunFuture[Any]):
    """A task run that has ended, as what another waits for: an edge of the graph and nothing else."""

    def __init__(self, task_run_id: UUID) -> None:
        super().__init__(task_run_id)
        self._final_state = Completed(data=True)  # Prefect asks every parent for a result

    def wait(self, timeout: float | None = None) -> None:
        """It has ended."""

    def result(self, timeout: float | None = None, raise_on_failure: bool = True) -> None:
        """Not told: the result is handed on by the flow."""

    def add_done_callback(self, fn: Callable[[PrefectFuture[Any]], None]) -> None:
        fn(self)


def _parents(inputs: Mapping[str, Any]) -> list[_Parent]:
    return [_Parent(source) for source in run.current().lineage.enter(list(inputs.values()))]


def _quoted(inputs: Mapping[str, Any]) -> dict[str, Any]:
    """Inputs that Prefect does not look into: the edges are known (tasks/lineage.py), and looking for them
    among values would find false ones."""
    return {name: quote(value) for name, value in inputs.items()}


def _parameters(context: TaskRunContext) -> dict[str, Any]:
    """A task run's inputs, whether Prefect has unquoted them yet or not."""
    return {
        name: value.unquote() if isinstance(value, quote) else value
        for name, value in context.parameters.items()
    }


def decode_verified(decoded: dict[str, Any]) -> Any:
    """Object hook of the result serializer: a File whose bytes are lost or altered makes a stale hit fail
    to decode, which Prefect takes for a miss."""
    if decoded.keys() == {"sha256", "size", "suffix"} and not store.current().holds(File(**decoded)):
        raise ValueError(f"stored file {decoded['sha256']} is lost or altered")
    return prefect_json_object_decoder(decoded)


def failure(state: State[Any]) -> BaseException | None:
    """The exception of a failed state."""
    if not (state.is_failed() or state.is_crashed()):
        return None
    problem = state.result(raise_on_failure=False)
    return problem if isinstance(problem, BaseException) else RuntimeError(state.message or "failed")


def item_name(inputs: Mapping[str, Any]) -> str:
    """What a mapped stage works on, in a person's words: its `name`, or its photo's or mosaic's."""
    for value in (inputs.get("name"), inputs.get("surface"), inputs.get("photo"), inputs.get("mosaic")):
        if value is not None and not isinstance(value, Pending):
            return value if isinstance(value, str) else str(getattr(value, "name", ""))
    return ""


def _results() -> Path:
    return store.current().root / "results"


def _tell(event: Event) -> None:
    run.current().listener(event)


def _has_pending(value: Any) -> bool:
    if isinstance(value, tuple | list):
        return any(_has_pending(part) for part in value)
    return isinstance(value, Pending)


def _differences(before: Mapping[str, str], now: Mapping[str, str]) -> list[str]:
    return sorted(name for name in before.keys() | now.keys() if before.get(name) != now.get(name))


def _one_line(problem: BaseException | None) -> str:
    return "".join(traceback.format_exception_only(problem)).strip() if problem else "failed"
