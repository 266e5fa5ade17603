"""`make bench-scans`: registration and surfaces against the simulator's truth, beside other programs."""

import argparse
import json
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from flows.console import out
from tests.benchmarks import real_scan_rows, registration_rows, surface_rows

PARTS = {
    "registration": registration_rows.rows,
    "real": real_scan_rows.rows,
    "surfaces": surface_rows.rows,
}
OTHER_PEERS = {  # package: why it has no rows
    "kiss-matcher": "not installed: pip install -e .[bench]",
    "CloudComPy": "not on PyPI",
    "cgal": "no row yet: its wheel holds CGAL_Shape_detection.efficient_RANSAC",
}


def main() -> None:
    asked = argparse.ArgumentParser(description=__doc__)
    asked.add_argument("--parts", nargs="*", choices=PARTS, default=list(PARTS))
    path = Path("build/bench/scans.json")
    path.parent.mkdir(parents=True, exist_ok=True)
    table: list[dict[str, Any]] = []
    for part in asked.parse_args().parts:
        for row in PARTS[part]():
            table.append(row)
            _say(row)
            path.write_text(json.dumps(table, indent=1, ensure_ascii=False) + "\n")  # what is done is kept
    for package, why in OTHER_PEERS.items():
        if not _installed(package):
            table.append({"what": "peer not measured", "value": None, "peer": package, "data": why})
            _say(table[-1])
    path.write_text(json.dumps(table, indent=1, ensure_ascii=False) + "\n")
    out.print(f"\n{path}")


def _say(row: dict[str, Any]) -> None:
    if row["value"] is None:
        out.print(f"{row['what']}: {row['peer']}: {row['data']}")
        return
    mark = {True: "holds", False: "MISSED", None: ""}[row["holds"]]
    peer = f"{row['peer']} {row['peer_value']:g}" if row["peer"] else ""
    value = f"{row['value']:10g} {row['unit']:9}"
    out.print(f"{row['what'][:74]:74} {value} {row['bar'] or '':8} {mark:7} {peer}", soft_wrap=True)


def _installed(package: str) -> bool:
    try:
        version(package)
    except PackageNotFoundError:
        return False
    return True


if __name__ == "__main__":
    main()
