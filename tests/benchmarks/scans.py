"""`make bench-scans`: registration and surfaces against the simulator's truth, beside other programs."""

from importlib.util import find_spec

from tests.benchmarks import real_scan_rows, registration_rows, surface_rows
from tests.benchmarks.table import Row, absent, gather


def other_peers() -> list[Row]:
    """Those that have no rows, and why."""
    rows = [absent("every row", "CloudComPy", "not on PyPI")]
    rows.append(absent("planes", "cgal", "no row yet: its wheel holds CGAL_Shape_detection.efficient_RANSAC"))
    if find_spec("kiss_matcher") is None:
        rows.append(absent("coarse alignment", "KISS-Matcher", "not installed: pip install -e .[bench]"))
    return rows


PARTS = {
    "registration": registration_rows.rows,
    "real": real_scan_rows.rows,
    "surfaces": surface_rows.rows,
    "other-peers": other_peers,
}

if __name__ == "__main__":
    gather("scans", PARTS)
