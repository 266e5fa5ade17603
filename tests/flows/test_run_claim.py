"""A run's folder is one inspection's and one command's."""

import subprocess
import sys
from pathlib import Path

import pytest

from flows.opening import opened
from flows.run_claim import OWNER, claimed, refuse_another_s
from schemas.problem import BadInput
from tasks import run

HOLD = """
import sys
from pathlib import Path
from flows.run_claim import claimed
with claimed(Path(sys.argv[1]), sys.argv[2]):
    print("held", flush=True)
    sys.stdin.read()
"""


@pytest.fixture
def site(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("HAIRLINE_STORE", str(tmp_path / "store"))
    for name in ("one", "two"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "inspection.yaml").write_text("name: Brücke\n")
    return tmp_path


def test_two_inspections_of_one_name_do_not_share_a_folder(site: Path) -> None:
    with opened("one/inspection.yaml") as held:
        assert held.folder == site / "runs" / "Brücke"
    with opened("one/../one/inspection.yaml"):
        pass
    told = "^runs/Brücke: belongs to one/inspection.yaml. Give this inspection another 'name'.*--out"
    with pytest.raises(BadInput, match=told), opened("two/inspection.yaml"):
        pass
    dry = run.Run(dry=True, lay_out=False)
    with pytest.raises(BadInput, match=told), run.running(dry), opened("two/inspection.yaml"):
        pass
    with opened("two/inspection.yaml", "runs/other"):
        pass
    (site / "one").rename(site / "old")
    with opened("two/inspection.yaml"):  # nobody's any more
        pass
    with pytest.raises(BadInput, match="belongs to two"), opened("old/inspection.yaml"):
        pass


def test_a_dry_run_takes_no_folder(site: Path) -> None:
    with run.running(run.Run(dry=True, lay_out=False)), opened("one/inspection.yaml") as held:
        assert not (held.folder / OWNER).exists()


def test_a_demo_s_folder_is_no_inspection_s(site: Path) -> None:
    with claimed(site, "demo:bridge"):
        pass
    refuse_another_s(site, "demo:bridge")
    with pytest.raises(BadInput, match="belongs to demo:bridge"):
        refuse_another_s(site, "one/inspection.yaml")


def test_a_copy_of_a_whole_project_is_its_own(site: Path) -> None:
    with opened("one/inspection.yaml", "one/runs/x"):
        pass
    (site / "copy").mkdir()
    for name in ("inspection.yaml", f"runs/x/{OWNER}"):
        (site / "copy" / name).parent.mkdir(parents=True, exist_ok=True)
        (site / "copy" / name).write_bytes((site / "one" / name).read_bytes())
    with opened("copy/inspection.yaml", "copy/runs/x"):
        pass


def test_a_second_command_is_refused_until_the_first_has_ended_however_it_ends(site: Path) -> None:
    words = [sys.executable, "-c", HOLD, str(site), "one/inspection.yaml"]
    with subprocess.Popen(words, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as first:
        assert first.stdout is not None
        assert first.stdout.readline() == b"held\n"
        told = "has not ended yet. Wait for it, or give another --out"
        with pytest.raises(BadInput, match=told), claimed(site, "one/inspection.yaml"):
            pass
        first.kill()
    with claimed(site, "one/inspection.yaml"):
        pass
