"""Real data for development lies beside the repository; users' machines do not have it."""

from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2] / "shared" / "data"


def development_data(name: str) -> Path:
    """Path of a development data set, or a skip that says what is absent."""
    path = ROOT / name
    if not path.exists():
        pytest.skip(f"development data {name} is not on this machine")
    return path
