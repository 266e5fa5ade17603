"""`make bench-planning`: path search, tour, coverage, clearance, a whole bridge and mission files.

Peers come with the `bench` extra; one that is not installed is a row that says so. Times are CPU seconds of
one thread."""

from tests.benchmarks import mission_rows, path_rows, plan_rows, tour_rows
from tests.benchmarks.table import gather

PARTS = {
    "paths": path_rows.rows,
    "tour": tour_rows.rows,
    "coverage": plan_rows.coverage,
    "clearance": plan_rows.clearance,
    "bridge": plan_rows.bridge,
    "large-site": plan_rows.large_site,
    "missions": mission_rows.rows,
}

if __name__ == "__main__":
    gather("planning", PARTS)
