"""The stage contract: hit, miss, altered file, redo, failing item, retry, pages, progress, dry run."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from prefect import flow
from prefect.client.orchestration import get_client
from prefect.client.schemas.filters import ArtifactFilter, ArtifactFilterKey
from prefect.client.schemas.sorting import TaskRunSort
from pydantic import ValidationError

from artifacts import store
from schemas.problem import BadInput, LeftOut
from tasks import run
from tasks.run import Event, Run
from tasks.stage import Pending
from tests.stage_examples import calls, copy_text, flaky, join, launch, lies, shout

pytestmark = pytest.mark.usefixtures("prefect_server", "own_store")


@pytest.fixture(autouse=True)
def _no_calls_yet() -> None:
    calls.clear()


def in_flow(body: Callable[[], Any], **settings: Any) -> tuple[Any, list[Event]]:
    events: list[Event] = []
    with run.running(Run(listener=events.append, **settings)):
        return flow(body, name="test")(), events


def outcomes(events: list[Event]) -> list[str]:
    return [event.outcome for event in events if event.outcome not in ("started", "progress")]


def test_equal_inputs_run_once_and_changed_inputs_again() -> None:
    result, events = in_flow(lambda: [shout("ada", 1), shout("ada", 1), shout("ada", 2)])
    assert [one.what for one in result] == ["ADA", "ADA", "ADAADA"]
    assert outcomes(events) == ["ran", "cached", "ran"]
    assert calls["shout"] == 2


def test_two_stages_with_equal_inputs_do_not_share_results(tmp_path: Path) -> None:
    assert shout.key({"name": "x"}).split("-")[1] != flaky.key({"name": "x"}).split("-")[1]


def test_an_unkeyed_input_does_not_run_the_stage_again() -> None:
    _, events = in_flow(lambda: [shout("ada", 1, workers=1), shout("ada", 1, workers=8)])
    assert outcomes(events) == ["ran", "cached"]


def test_a_file_enters_by_its_content_not_by_its_path(tmp_path: Path) -> None:
    def body() -> list[Any]:
        files = []
        for name in ("one.txt", "two.txt"):
            (tmp_path / name).write_text("same words")
            files.append(store.current().put(tmp_path / name))
        return [copy_text("a", file) for file in files]

    _, events = in_flow(body)
    assert outcomes(events) == ["ran", "cached"]


@pytest.mark.parametrize("damage", ["lost", "altered"])
def test_a_hit_whose_file_is_lost_or_altered_is_a_miss(tmp_path: Path, damage: str) -> None:
    (tmp_path / "in.txt").write_text("words")

    def body() -> Any:
        return copy_text("a", store.current().put(tmp_path / "in.txt"))

    result, _ = in_flow(body)
    stored = store.current().path(result)
    stored.unlink()
    if damage == "altered":
        stored.write_text("WORDZ")
    again, events = in_flow(body)
    assert outcomes(events) == ["ran"]
    assert store.current().path(again).read_text() == "WORDS"


def test_redo_runs_a_cached_stage_once_for_its_token() -> None:
    in_flow(lambda: shout("ada", 1))
    _, first = in_flow(lambda: shout("ada", 1), redo={"shout": "token"})
    _, resumed = in_flow(lambda: shout("ada", 1), redo={"shout": "token"})
    assert (outcomes(first), outcomes(resumed)) == (["ran"], ["cached"])


def test_one_bad_item_among_good_ones_is_handed_back_by_name() -> None:
    results, events = in_flow(lambda: shout.each([("ada", 1), ("nobody", 1), ("bob", 1)]))
    assert [isinstance(one, BadInput) for one in results] == [False, True, False]
    assert results[1].item == "nobody"
    assert sorted(outcomes(events)) == ["failed", "ran", "ran"]
    assert calls["shout"] == 3  # a BadInput is not tried again


def test_an_unforeseen_failure_is_tried_once_more() -> None:
    result, _ = in_flow(lambda: flaky("x"))
    assert result.what == "worked"
    assert calls["flaky"] == 2


def test_an_action_in_the_world_is_never_repeated_by_itself_nor_keyed_by_its_code() -> None:
    with pytest.raises(OSError, match="link lost"):
        in_flow(lambda: launch("drone", "1"))
    assert calls["launch"] == 1
    assert launch._key_parts({"name": "a", "mission": "1"})[0] == {}


def test_inputs_and_output_are_checked_against_the_annotations() -> None:
    with pytest.raises(ValidationError):
        shout.bare("ada", "many")  # type: ignore[arg-type]
    with pytest.raises(ValidationError):
        lies.bare("x")


def test_pages_appear_on_a_run_and_on_a_hit() -> None:
    in_flow(lambda: shout("pages", 3))
    in_flow(lambda: shout("pages", 3))
    with get_client(sync_client=True) as client:
        found = client.read_artifacts(artifact_filter=ArtifactFilter(key=ArtifactFilterKey(any_=["shout"])))
    assert [one.data for one in found].count("# PAGESPAGESPAGES") == 2


def test_progress_is_told_to_the_listener() -> None:
    _, events = in_flow(lambda: shout("progress", 1))
    assert [(e.item, e.fraction) for e in events if e.outcome == "progress"] == [("progress", 0.5)]


def test_the_dashboard_shows_a_stage_that_is_done_as_done() -> None:
    """Though its last word was "half"."""

    def shown() -> dict[Any, Any]:
        with get_client(sync_client=True) as client:
            named = ArtifactFilter(key=ArtifactFilterKey(any_=["progress-shout"]))
            return {one.id: one.data for one in client.read_artifacts(artifact_filter=named)}

    before = shown()
    in_flow(lambda: shout("done", 1))
    assert [data for id, data in shown().items() if id not in before] == [100.0]


def test_a_dry_run_says_why_a_stage_will_run_and_runs_none(tmp_path: Path) -> None:
    in_flow(lambda: shout("ada", 1), folder=tmp_path)
    calls.clear()

    def body() -> Any:
        unknown = shout("ada", 2)
        return shout("ada", 1), unknown

    events: list[Event] = []
    with run.running(Run(folder=tmp_path, dry=True, listener=events.append)):
        known, unknown = body()
    assert isinstance(known, LeftOut)
    assert isinstance(unknown, Pending)
    assert [(e.outcome, e.detail) for e in events] == [("will run", "times changed"), ("cached", "")]
    assert not calls


def test_the_graph_has_an_edge_where_a_result_went_and_nowhere_else() -> None:
    common = LeftOut(item="common", stage="none", what="from outside")

    def body() -> list[Any]:
        first, second = join.each([(name, (common,)) for name in ("ada", "bob")])
        return [join("both", (first, second)), join("one", (second, common))]

    in_flow(body)
    with get_client(sync_client=True) as client:
        runs = {one.name: one for one in client.read_task_runs(sort=TaskRunSort.END_TIME_DESC, limit=4)}
    names = {one.id: name for name, one in runs.items()}

    def parents(name: str) -> set[str]:
        edges = [edge for found in runs[name].task_inputs.values() for edge in found]
        return {names[edge.id] for edge in edges}

    assert parents("join ada") == parents("join bob") == set()
    assert parents("join both") == {"join ada", "join bob"}
    assert parents("join one") == {"join bob"}
