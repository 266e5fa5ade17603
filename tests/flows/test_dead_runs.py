"""Which runs are known to be dead. That they are marked: tests/end_to_end/test_resume.py."""

import os
import subprocess
import sys
from uuid import uuid4

import pytest
from prefect.client.schemas.objects import FlowRun

from flows.dead_runs import _here, _is_dead


def run_of(told: str | None) -> FlowRun:
    return FlowRun(flow_id=uuid4(), infrastructure_pid=told)


def test_only_a_process_of_this_machine_that_is_gone_is_dead() -> None:
    process = subprocess.Popen([sys.executable, "-c", ""])
    process.wait()
    assert _is_dead(run_of(f"{_here()}:{process.pid}"))
    assert not _is_dead(run_of(f"{_here()}:{os.getpid()}"))
    assert not _is_dead(run_of(f"{_here()}:1"))  # perhaps somebody else's
    assert not _is_dead(run_of(f"{_here()}1:{process.pid}"))  # a container with this machine's name
    assert not _is_dead(run_of(f"elsewhere/4026531836:{process.pid}"))


@pytest.mark.parametrize("told", [None, "", "somewhere", "somewhere:?"])
def test_a_run_that_does_not_say_is_left_alone(told: str | None) -> None:
    assert not _is_dead(run_of(told))
