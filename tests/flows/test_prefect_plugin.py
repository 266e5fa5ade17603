"""`prefect deployment run inspect-bridge` means inspect-bridge/inspect-bridge."""

import pytest

from flows.prefect_plugin import with_flow_name


@pytest.mark.parametrize(
    ("typed", "meant"),
    [
        ("prefect deployment run inspect-bridge", "prefect deployment run inspect-bridge/inspect-bridge"),
        ("prefect deployment run a/b", "prefect deployment run a/b"),
        ("prefect deployment run --id 7", "prefect deployment run --id 7"),
        ("prefect deployment run x --param n=1", "prefect deployment run x/x --param n=1"),
        ("prefect --profile p deployment run x", "prefect --profile p deployment run x/x"),
        ("prefect deployment ls", "prefect deployment ls"),
        ("prefect", "prefect"),
    ],
)
def test_a_bare_name_gets_its_flows_name(typed: str, meant: str) -> None:
    assert with_flow_name(typed.split()) == meant.split()
