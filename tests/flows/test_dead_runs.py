"""Which runs are known to be dead. That they are marked: tests/end_to_end/test_resume.py."""

import os
import subprocess
import sys
from uuid import uuid4

import pytest
from prefect.client.schemas.objects import FlowRun

from flows.dead_runs import _here, _is_dead


def ended() -> int:
    """Number of a process that was."""
    process = subprocess.Popen([sys.executable, "-c", ""])
    process.wait()
    return process.pid


@pytest.mark.parametrize(
    ("where", "pid", "dead"),
    [
        (_here(), ended(), True),
        (_here(), os.getpid(), False),
        (_here(), 1, False),  # perhaps somebody else's
        (f"{_here()}1", ended(), False),  # a container with this machine's name
        ("elsewhere/4026531836", ended(), False),
    ],
)
def test_only_a_process_of_this_machine_that_is_gone_is_dead(where: str, pid: int, dead: bool) -> None:
    assert _is_dead(FlowRun(flow_id=uuid4(), infrastructure_pid=f"{where}:{pid}")) == dead


@pytest.mark.parametrize("told", [None, "", "somewhere", f"{_here()}:?"])
def test_a_run_that_does_not_say_is_left_alone(told: str | None) -> None:
    assert not _is_dead(FlowRun(flow_id=uuid4(), infrastructure_pid=told))
