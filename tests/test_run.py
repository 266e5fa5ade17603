"""What a run remembers of its stages."""

from pathlib import Path

import pytest

from tasks.run import KeyParts, Run, running


def test_what_keys_were_made_of_is_there_the_next_time(tmp_path: Path) -> None:
    with running(Run(folder=tmp_path)) as first:
        first.last["detect/a"] = KeyParts(code={"a.py": "1"}, inputs={"photo": "2"})
    with running(Run(folder=tmp_path)) as second:
        assert second.last == first.last
    assert [path.name for path in tmp_path.iterdir()] == [".stages.json"]


@pytest.mark.parametrize("damage", [b"", b"[]", b"{", b'{"detect/a": 3}', b"\xff"])
def test_a_damaged_record_is_none(tmp_path: Path, damage: bytes) -> None:
    (tmp_path / ".stages.json").write_bytes(damage)
    with running(Run(folder=tmp_path)) as run:
        assert run.last == {}
