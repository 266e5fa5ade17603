"""The cracks for other programs: cracks.json (the whole report) and cracks.csv (one line a crack)."""

import csv
import io
import json
from pathlib import Path

from schemas.crack import Crack
from schemas.crack_report import CrackReport

FORMULA_STARTS = ("=", "+", "-", "@", "\t", "\r")  # a spreadsheet would run such a text


def write_json(path: Path, report: CrackReport) -> None:
    """The report as it is, keys sorted: equal reports give equal bytes."""
    text = json.dumps(report.model_dump(mode="json"), indent=1, sort_keys=True, ensure_ascii=False)
    path.write_text(text + "\n", encoding="utf-8", newline="\n")


def write_csv(path: Path, report: CrackReport) -> None:
    """UTF-8 with a header line; units stand in the column names, an unknown value is an empty field."""
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(_row(None))
    writer.writerows(_row(crack).values() for crack in report.cracks)
    path.write_text(stream.getvalue(), encoding="utf-8", newline="\n")


def _row(crack: Crack | None) -> dict[str, str]:
    """Column names and fields; of None, the names with empty fields."""
    if crack is None:
        crack = _NAMES_ONLY
    middle = crack.middle_px or (None, None)
    x_m, y_m, z_m = crack.position_m or (None, None, None)
    u_m, v_m = crack.position_uv_m or (None, None)
    return {
        "id": _text(crack.id),
        "surface": _text(crack.surface),
        "severity": _text(crack.severity),
        "kind": _text(crack.kind),
        "length_mm": _fixed(crack.length_mm, 1),
        "length_sigma_mm": _fixed(crack.length_sigma_mm, 1),
        "width_median_mm": _fixed(crack.width_median_mm, 2),
        "width_max_mm": _fixed(crack.width_max_mm, 2),
        "width_sigma_mm": _fixed(crack.width_sigma_mm, 2),
        "width_is_upper_bound": str(crack.width_is_upper_bound).lower(),
        "orientation_deg": _fixed(crack.orientation_deg, 1),
        "u_m": _fixed(u_m, 3),
        "v_m": _fixed(v_m, 3),
        "x_m": _fixed(x_m, 3),
        "y_m": _fixed(y_m, 3),
        "z_m": _fixed(z_m, 3),
        "length_px": _fixed(crack.length_px, 1),
        "width_median_px": _fixed(crack.width_median_px, 2),
        "width_max_px": _fixed(crack.width_max_px, 2),
        "x_px": _fixed(middle[0], 1),
        "y_px": _fixed(middle[1], 1),
        "photo": _text(crack.photo),
    }


_NAMES_ONLY = Crack(
    id="", surface="", polyline_px=(), length_px=0, width_median_px=0, width_max_px=0, orientation_deg=0
)


def _fixed(value: float | None, decimals: int) -> str:
    return "" if value is None else f"{value:.{decimals}f}"


def _text(value: str | None) -> str:
    value = value or ""
    return f"'{value}" if value.startswith(FORMULA_STARTS) else value
