"""The content store keeps bytes, notices when they change, and leaves nothing behind."""

from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from artifacts import store
from artifacts.store import Store
from schemas.problem import BadInput


@given(content=st.binary(max_size=2000))
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=30)
def test_what_is_put_is_read_back(tmp_path: Path, content: bytes) -> None:
    source = tmp_path / "source.bin"
    source.unlink(missing_ok=True)
    source.write_bytes(content)
    kept = Store(tmp_path / "store")
    file = kept.put(source)
    assert kept.path(file).read_bytes() == content
    assert (file.size, file.suffix) == (len(content), ".bin")


def test_what_cannot_be_read_is_told_by_its_name(tmp_path: Path) -> None:
    (tmp_path / "folder.jpg").mkdir()
    with pytest.raises(BadInput, match=r"^folder\.jpg: cannot be read"):
        Store(tmp_path / "store").put(tmp_path / "folder.jpg")


def test_the_same_bytes_are_kept_once(tmp_path: Path) -> None:
    kept = Store(tmp_path / "store")
    for name in ("a.txt", "b.txt"):
        (tmp_path / name).write_text("same")
        kept.put(tmp_path / name)
    assert len([p for p in (tmp_path / "store" / "objects").rglob("*") if p.is_file()]) == 1


def test_altered_bytes_are_noticed_and_put_right_by_putting_again(tmp_path: Path) -> None:
    kept = Store(tmp_path / "store")
    (tmp_path / "a.txt").write_text("right")
    file = kept.put(tmp_path / "a.txt")
    path = kept.path(file)
    path.unlink()
    path.write_text("wrong")
    assert not kept.holds(file)
    with pytest.raises(FileNotFoundError, match="not in the store"):
        kept.path(file)
    kept.put(tmp_path / "a.txt")
    assert kept.path(file).read_text() == "right"


def test_a_folder_is_the_sorted_manifest_of_its_files(tmp_path: Path) -> None:
    (tmp_path / "in" / "deep").mkdir(parents=True)
    (tmp_path / "in" / "z.txt").write_text("z")
    (tmp_path / "in" / "deep" / "a.txt").write_text("a")
    folder = Store(tmp_path / "store").put_folder(tmp_path / "in")
    assert [entry.name for entry in folder.entries] == ["deep/a.txt", "z.txt"]


def test_a_temporary_store_is_gone_when_its_command_ends(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("HAIRLINE_STORE", "elsewhere")
    with store.temporary() as kept:
        assert store.current().root == kept.root
        root = kept.root
        root.mkdir(exist_ok=True)
    assert not root.exists()
    assert store.current().root.name == "elsewhere"
