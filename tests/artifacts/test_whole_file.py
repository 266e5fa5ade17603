"""A file is there whole or not at all."""

from pathlib import Path

import pytest

from artifacts.whole_file import whole


def test_it_takes_its_place_at_the_end_or_leaves_nothing(tmp_path: Path) -> None:
    path = tmp_path / "plan.json"
    with whole(path) as temporary:
        temporary.write_text("first")
        assert not path.exists()
    with pytest.raises(OSError, match="full"), whole(path) as temporary:
        temporary.write_text("sec")
        raise OSError("full")
    assert path.read_text() == "first"
    assert list(tmp_path.iterdir()) == [path]
