"""The tables for programs: complete, stable, with units, and harmless in a spreadsheet."""

import csv
import json
from pathlib import Path

from artifacts import crack_tables
from schemas.crack import Crack
from schemas.crack_report import CrackReport
from tests.artifacts.inspected import Inspected

UNITLESS = {"id", "surface", "severity", "kind", "width_is_upper_bound", "photo"}


def rows_of(report: CrackReport, path: Path) -> list[dict[str, str]]:
    crack_tables.write_csv(path, report)
    with path.open(encoding="utf-8", newline="") as stream:
        return list(csv.DictReader(stream))


def test_json_reads_back_as_the_same_report_with_sorted_keys(bridge: Inspected, tmp_path: Path) -> None:
    path = tmp_path / "cracks.json"
    crack_tables.write_json(path, bridge.report)
    assert CrackReport.model_validate_json(path.read_bytes()) == bridge.report
    keys = list(json.loads(path.read_text(encoding="utf-8"))["cracks"][0])
    assert keys == sorted(keys)


def test_csv_has_a_line_for_each_crack_and_a_unit_in_each_name(bridge: Inspected, tmp_path: Path) -> None:
    rows = rows_of(bridge.report, tmp_path / "cracks.csv")
    assert [row["id"] for row in rows] == [crack.id for crack in bridge.report.cracks]
    for name in rows[0]:
        assert name in UNITLESS or name.endswith(("_mm", "_m", "_px", "_deg")), name
    for row, crack in zip(rows, bridge.report.cracks, strict=True):
        assert crack.width_max_mm is not None and crack.position_m is not None
        assert abs(float(row["width_max_mm"]) - crack.width_max_mm) <= 0.005
        assert abs(float(row["z_m"]) - crack.position_m[2]) <= 0.0005
        assert abs(float(row["orientation_deg"]) - crack.orientation_deg) <= 0.05


def test_what_is_not_known_is_an_empty_field(tmp_path: Path) -> None:
    crack = Crack(
        id="x-C001", surface="x", polyline_px=((1.0, 2.0), (9.0, 2.0)), length_px=8.0, width_median_px=1.0,
        width_max_px=2.0, orientation_deg=0.0,
    )  # fmt: skip
    report = CrackReport(inspection="x", method="paper", surfaces=(), cracks=(crack,), not_inspected=())
    (row,) = rows_of(report, tmp_path / "cracks.csv")
    assert row["length_mm"] == row["severity"] == row["x_m"] == ""
    assert row["length_px"] == "8.0"


def test_no_name_is_run_as_a_formula_by_a_spreadsheet(bridge: Inspected, tmp_path: Path) -> None:
    crack = bridge.report.cracks[0].model_copy(update={"surface": "=1+1", "photo": '@SUM(A1),"\n'})
    report = bridge.report.model_copy(update={"cracks": (crack,)})
    (row,) = rows_of(report, tmp_path / "cracks.csv")
    assert row["surface"] == "'=1+1"
    assert row["photo"] == "'@SUM(A1),\"\n"


def test_no_crack_leaves_the_header(tmp_path: Path) -> None:
    report = CrackReport(inspection="x", method="paper", surfaces=(), cracks=(), not_inspected=())
    assert rows_of(report, tmp_path / "cracks.csv") == []
    assert (
        (tmp_path / "cracks.csv").read_text(encoding="utf-8").startswith("id,surface,severity,kind,length_mm")
    )
