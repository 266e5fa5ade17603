"""Runs whose process was killed: Prefect hears nothing of that and would show them as running for ever."""

import os
import socket
from contextlib import suppress
from pathlib import Path
from typing import Any
from uuid import UUID

import httpx
from prefect import Flow
from prefect.client.orchestration import SyncPrefectClient, get_client
from prefect.client.schemas.filters import (
    FlowRunFilter,
    FlowRunFilterId,
    FlowRunFilterState,
    FlowRunFilterStateType,
    TaskRunFilter,
    TaskRunFilterState,
    TaskRunFilterStateType,
)
from prefect.client.schemas.objects import FlowRun, State, StateType
from prefect.states import Crashed

KILLED = "Its process was killed. Run it again to go on: finished stages are kept."


def note_process(flow: Flow[..., Any], flow_run: FlowRun, state: State[Any]) -> None:
    """Hook of a flow that starts to run: the run says on which machine and by which process."""
    with get_client(sync_client=True) as client:
        client.update_flow_run(flow_run.id, infrastructure_pid=f"{_here()}:{os.getpid()}")


def mark_dead_runs() -> None:
    """As crashed, with the tasks they were in, every run of this machine whose process is gone. A server that
    does not let us is left as it is: nothing hangs on it."""
    running = FlowRunFilter(state=FlowRunFilterState(type=FlowRunFilterStateType(any_=[StateType.RUNNING])))
    with suppress(httpx.HTTPError), get_client(sync_client=True) as client:
        for run in filter(_is_dead, client.read_flow_runs(flow_run_filter=running)):
            _mark(client, run.id)


def _here() -> str:
    """This machine, and whose processes are numbered together: a container may have the machine's name."""
    try:
        space = Path("/proc/self/ns/pid").stat().st_ino
    except OSError:
        space = 0
    return f"{socket.gethostname()}/{space}"


def _is_dead(run: FlowRun) -> bool:
    where, _, pid = (run.infrastructure_pid or "").rpartition(":")
    if os.name != "posix" or where != _here() or not pid.isdigit():
        return False
    try:
        os.kill(int(pid), 0)
    except ProcessLookupError:
        return True
    except PermissionError:  # somebody else's
        pass
    return False


def _mark(client: SyncPrefectClient, flow_run_id: UUID) -> None:
    tasks = client.read_task_runs(
        flow_run_filter=FlowRunFilter(id=FlowRunFilterId(any_=[flow_run_id])),
        task_run_filter=TaskRunFilter(
            state=TaskRunFilterState(type=TaskRunFilterStateType(any_=[StateType.RUNNING]))
        ),
    )
    for task in tasks:
        client.set_task_run_state(task.id, Crashed(message=KILLED), force=True)
    client.set_flow_run_state(flow_run_id, Crashed(message=KILLED), force=True)
