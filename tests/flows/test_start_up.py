"""What a run loads before it knows that a stage has to run."""

import subprocess
import sys

HEAVY = ("matplotlib", "numba", "open3d", "scipy", "skimage")


def test_flows_load_no_stage_that_does_not_run() -> None:
    """A run whose every result is cached takes as long as its imports: each of these costs up to a second."""
    code = f"import sys, flows.inspect_bridge, flows.running; print([n for n in {HEAVY} if n in sys.modules])"
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert loaded.strip() == "[]"
