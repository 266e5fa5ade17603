"""The logs of a flight that somebody else flew, before they are understood."""

from pathlib import Path

import pytest

from flows.external_flight import given_logs
from flows.inspect_bridge import inspect, with_flight
from flows.opening import OpenRun
from schemas.inspection import Inspection
from schemas.problem import BadInput

ULOG = b"ULog\x01\x12\x35"


def test_a_log_that_is_missing_or_none_is_told_before_anything_runs(tmp_path: Path) -> None:
    (tmp_path / "text.tlog").write_text("this is only text\n")
    (tmp_path / "logs").mkdir()
    for named, told in (
        ("none.tlog", "none.tlog: named by key 'flight_log', does not exist"),
        ("text.tlog", "text.tlog: is no flight log that Hairline knows"),
        ("logs", "logs: holds no log"),
    ):
        inspection = Inspection(name="x", flight_log=named)
        with pytest.raises(BadInput, match=told):
            inspect(OpenRun(inspection, tmp_path, tmp_path / "run"))


def test_a_folder_of_logs_is_all_of_them(tmp_path: Path) -> None:
    (tmp_path / "logs").mkdir()
    for name in ("logs/b.ulg", "logs/a.ulg", "c.ulg"):
        (tmp_path / name).write_bytes(ULOG)
    given = given_logs(Inspection(name="x", flight_log=("logs", "c.ulg")), tmp_path)
    assert [path.name for path in given] == ["a.ulg", "b.ulg", "c.ulg"]


def test_photos_and_logs_that_the_command_names_are_looked_for_from_here(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    run = OpenRun(Inspection(name="x"), tmp_path / "site", tmp_path / "run")
    with pytest.raises(BadInput, match=r"^--log a\.ulg: no such file"):
        with_flight(run, None, ("a.ulg",))
    with pytest.raises(BadInput, match=r"^--photos cards: no such file or folder"):
        with_flight(run, "cards", ())
    Path("a.ulg").write_bytes(ULOG)
    assert with_flight(run, None, ("a.ulg",)).inspection.flight_log == (str(tmp_path / "a.ulg"),)
