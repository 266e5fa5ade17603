"""Which Prefect server a command talks to."""

import pytest
from prefect.settings import PREFECT_API_URL, temporary_settings

from flows import running
from flows.own_server import answers

NOBODY = "http://127.0.0.1:9/api"


def test_where_none_answers_one_of_its_own_does_and_ends_and_one_that_answers_is_used(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(running, "SERVER", NOBODY)
    with temporary_settings({PREFECT_API_URL: NOBODY}), running.server():
        own = PREFECT_API_URL.value()
        assert own is not None and own != NOBODY and answers(own)
        with running.server():
            assert PREFECT_API_URL.value() == own
    assert f"No Prefect server answers at {NOBODY}" in " ".join(capsys.readouterr().out.split())
    assert not answers(own)
