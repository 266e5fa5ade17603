"""Kill the process in any stage and run the same command again: same cracks, byte for byte."""

import contextlib
import os
import signal
import sqlite3
import subprocess
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from flows.own_server import answers
from flows.running import SERVER
from tests.end_to_end.commands import HAIRLINE, environment, hairline
from tests.small_inspection import write_inspection

RUN = ("run", "site/inspection.yaml")


@pytest.mark.slow
def test_after_a_kill_the_run_goes_on_to_the_same_cracks(tmp_path: Path) -> None:
    for name in ("undisturbed", "killed"):
        write_inspection(tmp_path / name / "site", photos=2)
    hairline(*RUN, cwd=tmp_path / "undisturbed")
    for stage in ("detect", "write report"):
        _kill_in(stage, tmp_path / "killed")
    finished = hairline(*RUN, cwd=tmp_path / "killed").stdout
    assert "ingest ×2: 2 cached" in finished
    assert _cracks(tmp_path / "killed") == _cracks(tmp_path / "undisturbed")
    if not answers(SERVER):  # else the runs are in the database of somebody's `hairline serve`
        assert _states(tmp_path / "killed", "flow_run") == {"CRASHED": 2, "COMPLETED": 1}
        assert "RUNNING" not in _states(tmp_path / "killed", "task_run")


def _states(home: Path, table: str) -> dict[str, int]:
    """How many rows of each state Prefect's database has."""
    with contextlib.closing(sqlite3.connect(home / ".prefect" / "prefect.db")) as database:
        return dict(database.execute(f"select state_type, count(*) from {table} group by state_type"))


def _cracks(folder: Path) -> bytes:
    return (folder / "runs/small/report/cracks.json").read_bytes()


def _kill_in(stage: str, cwd: Path) -> None:
    """SIGKILL as soon as the line says that the stage has started; its server ends with it."""
    with _running(cwd) as process:
        _wait_for(stage, process)
        servers = _servers_of(process.pid)
        process.kill()
    assert servers or answers(SERVER)  # that of somebody's `hairline serve`
    _wait_until(lambda: not any(Path(f"/proc/{pid}").exists() for pid in servers))


@pytest.mark.slow
def test_ctrl_c_says_in_one_line_that_nothing_is_lost(tmp_path: Path) -> None:
    """A terminal interrupts every process of the command at once."""
    write_inspection(tmp_path / "site", photos=2)
    with _running(tmp_path) as process:
        _wait_for("detect", process)
        servers = _servers_of(process.pid)
        os.killpg(process.pid, signal.SIGINT)
        said, _ = process.communicate(timeout=120)
    assert process.returncode == 130, said
    assert said.splitlines()[-1].startswith("Interrupted: finished stages are kept"), said
    assert "Error" not in said and "Traceback" not in said, said
    assert servers or answers(SERVER)
    assert not any(Path(f"/proc/{pid}").exists() for pid in servers)


def _running(cwd: Path) -> "subprocess.Popen[str]":
    return subprocess.Popen(
        [str(HAIRLINE), *RUN],
        cwd=cwd,
        env=environment(cwd, PYTHONUNBUFFERED="1"),
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        start_new_session=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL) and None,
    )


def _wait_for(stage: str, process: "subprocess.Popen[str]") -> None:
    assert process.stdout is not None
    deadline_s = time.monotonic() + 240
    for line in process.stdout:
        if line.strip() == f"… {stage}" or time.monotonic() > deadline_s:
            return


def _servers_of(pid: int) -> list[int]:
    return [int(child) for child in Path(f"/proc/{pid}/task/{pid}/children").read_text().split()]


def _wait_until(true: Callable[[], bool]) -> None:
    deadline_s = time.monotonic() + 60
    while not true():
        assert time.monotonic() < deadline_s
        time.sleep(0.2)
