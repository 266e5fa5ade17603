"""One inspected bridge and its report serve all tests of what is written for people."""

from pathlib import Path

import pytest

from artifacts.report import write_report
from tests.artifacts.inspected import Inspected, inspected_bridge


@pytest.fixture(scope="package")
def bridge(tmp_path_factory: pytest.TempPathFactory) -> Inspected:
    return inspected_bridge(tmp_path_factory.mktemp("bridge"))


@pytest.fixture(scope="package")
def bridge_report(bridge: Inspected, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("report")
    write_report(folder, **bridge.report_inputs())
    return folder
