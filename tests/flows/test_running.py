"""An inspection as a user runs it: once, again, after a change, after a failure, with bad items."""

import json
import re
from collections.abc import Callable
from pathlib import Path

import pytest

from flows import running
from schemas.problem import BadInput
from tests.small_inspection import photograph_crack, write_inspection

pytestmark = pytest.mark.usefixtures("prefect_server")

Run = Callable[..., str]


@pytest.fixture
def run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Run:
    """Runs tmp_path/site/inspection.yaml into tmp_path/runs/small; gives what it printed."""
    monkeypatch.chdir(tmp_path)
    write_inspection(tmp_path / "site")

    def run_it(*redo: str, expect: int = 0) -> str:
        assert running.run_inspection("site/inspection.yaml", None, redo, None, ()) == expect
        return capsys.readouterr().out

    return run_it


def ran(printed: str) -> set[str]:
    """The stages whose line says that something ran."""
    return {
        re.sub(r" ×.*", "", line.split(":")[0]).strip(" ✓")
        for line in printed.splitlines()
        if line.startswith("  ✓") and not re.search(r": (\d+ )?cached$", line)
    }


def test_the_report_and_its_tables_are_there_and_say_what_was_found(run: Run, tmp_path: Path) -> None:
    run()
    report = tmp_path / "runs" / "small" / "report"
    assert {"index.html", "cracks.csv", "cracks.json"} <= {path.name for path in report.iterdir()}
    cracks = json.loads((report / "cracks.json").read_text())["cracks"]
    assert {crack["surface"] for crack in cracks} == {"wall-1.jpg", "wall-2.jpg", "wall-3.jpg"}
    for crack in cracks:
        assert crack["width_median_mm"] == pytest.approx(2.5, rel=0.15)
        assert crack["length_mm"] == pytest.approx(210, rel=0.1)


def test_the_same_inputs_twice_execute_no_stage(run: Run, tmp_path: Path) -> None:
    run()
    first = (tmp_path / "runs/small/report/cracks.json").read_bytes()
    assert ran(run()) == set()
    assert (tmp_path / "runs/small/report/cracks.json").read_bytes() == first


def test_one_changed_photo_runs_only_what_depends_on_it(run: Run, tmp_path: Path) -> None:
    run()
    photograph_crack(tmp_path / "site/photos/wall-2.jpg", seed=9)
    printed = run()
    for stage in ("ingest", "single", "remove patterns", "detect", "measure"):
        assert f"{stage} ×3: 1 ran, 2 cached" in printed
    assert {"assess", "write report"} <= ran(printed)


def test_a_redo_runs_the_named_stage_again(run: Run) -> None:
    run()
    assert ran(run("measure")) == {"measure"}
    assert ran(run()) == set()


def test_damaged_notes_of_the_run_before_are_none(run: Run, tmp_path: Path) -> None:
    run()
    for name in (".stages.json", ".redo.json"):
        (tmp_path / "runs/small" / name).write_text("[]")
    assert ran(run("measure")) == {"measure"}


def test_a_stage_that_does_not_exist_is_told_with_those_that_do(run: Run) -> None:
    with pytest.raises(BadInput, match=r"detect.*measure"):
        run("dtect")


def test_a_flight_is_not_redone(run: Run) -> None:
    with pytest.raises(BadInput, match="mission"):
        run("fly")


def test_a_bad_photo_among_good_ones_is_left_out_by_name(run: Run, tmp_path: Path) -> None:
    broken = tmp_path / "site/photos/wall-2.jpg"
    broken.write_bytes(broken.read_bytes()[:900])
    printed = run()
    assert printed.splitlines()[-1].startswith("Warning: not inspected: wall-2.jpg")
    report = json.loads((tmp_path / "runs/small/report/cracks.json").read_text())
    assert [left["item"] for left in report["not_inspected"]] == ["wall-2.jpg"]
    assert {crack["surface"] for crack in report["cracks"]} == {"wall-1.jpg", "wall-3.jpg"}


def test_a_log_that_nothing_uses_is_told(
    run: Run, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for log in (tmp_path / "b.ulg", tmp_path / "site" / "a.ulg"):
        log.write_bytes(b"ULog\x01\x12\x35")
    assert running.run_inspection("site/inspection.yaml", None, (), None, (Path("b.ulg"),)) == 0
    assert "not inspected: flight_log: not used: nothing says whose flight" in capsys.readouterr().out
    path = tmp_path / "site/inspection.yaml"
    path.write_text(path.read_text() + "flight: external\nflight_log: a.ulg\n")
    assert "flight: not used: no plan was made, since the key 'scans' is missing (and 1 more" in run()


def test_no_usable_photo_is_an_error_that_names_one(run: Run, tmp_path: Path) -> None:
    for path in (tmp_path / "site/photos").iterdir():
        path.write_bytes(b"not a photo")
    with pytest.raises(BadInput) as caught:
        run()
    assert caught.value.item == "wall-1.jpg"


def test_a_dry_run_says_what_will_run_and_why_and_runs_nothing(
    run: Run, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    def dry() -> str:
        assert running.dry_run("site/inspection.yaml", None, ()) == 0
        return capsys.readouterr().out

    assert "ingest ×3: 3 will run: has not run yet" in dry()
    assert not (tmp_path / "runs/small/report").exists()
    run()
    assert "will run" not in dry()
    photograph_crack(tmp_path / "site/photos/wall-2.jpg", seed=9)
    assert "ingest ×3: 2 cached, will run: file changed" in dry()
