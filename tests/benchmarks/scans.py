"""`make bench-scans`: registration and surfaces against the simulator's truth, beside other programs."""

from collections.abc import Callable, Iterator
from functools import partial
from importlib.util import find_spec

from tests.benchmarks import (
    look_alike_rows,
    real_scan_rows,
    registration_rows,
    scan_scale_rows,
    surface_rows,
)
from tests.benchmarks.table import Row, absent, gather


def other_peers() -> list[Row]:
    """Those that have no rows, and why."""
    rows = [absent("every row", "CloudComPy", "not on PyPI")]
    for what, peer, module in (
        ("planes", "CGAL", "CGAL"),
        ("coarse alignment", "KISS-Matcher", "kiss_matcher"),
    ):
        if find_spec(module) is None:
            rows.append(absent(what, peer, "not installed: pip install -e .[bench]"))
    return rows


PARTS: dict[str, Callable[[], Iterator[Row] | list[Row]]] = {
    **registration_rows.PARTS,
    "look-alikes": look_alike_rows.rows,
    **scan_scale_rows.PARTS,
    "real": real_scan_rows.rows,
    **{name: partial(surface_rows.structure, name) for name in surface_rows.BARS},
    **{f"{name}-faults": partial(surface_rows.faults, name) for name in surface_rows.BARS},
    "surfaces-growth": surface_rows.growth,
    "surface-names": surface_rows.names,
    "other-peers": other_peers,
}

if __name__ == "__main__":
    gather("scans", PARTS)
