"""Kill the process in any stage and run the same command again: same cracks, byte for byte."""

import os
import signal
import subprocess
import time
from pathlib import Path

import pytest

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


def _cracks(folder: Path) -> bytes:
    return (folder / "runs/small/report/cracks.json").read_bytes()


def _kill_in(stage: str, cwd: Path) -> None:
    """SIGKILL, to its server too, as soon as the line says that the stage has started."""
    with subprocess.Popen(
        [str(HAIRLINE), *RUN],
        cwd=cwd,
        env=environment(cwd, PYTHONUNBUFFERED="1"),
        stdout=subprocess.PIPE,
        text=True,
        start_new_session=True,
    ) as process:
        assert process.stdout is not None
        deadline_s = time.monotonic() + 240
        for line in process.stdout:
            if line.strip() == f"… {stage}" or time.monotonic() > deadline_s:
                break
        os.killpg(process.pid, signal.SIGKILL)
