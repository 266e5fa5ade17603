"""Readable names: links into the store, real copies of what people mail, and nothing of yesterday's."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from artifacts import store
from artifacts.run_folder import LONGEST, lay_out, remove_stale, safe_name
from schemas.file import File, Folder, FolderEntry


@pytest.fixture
def shelf(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[store.Store]:
    monkeypatch.setenv("HAIRLINE_STORE", str(tmp_path / "store"))
    yield store.current()


def put(shelf: store.Store, text: str, suffix: str = ".txt") -> File:
    with shelf.scratch() as folder:
        path = folder / f"file{suffix}"
        path.write_text(text)
        return shelf.put(path)


def names_in(folder: Path) -> list[str]:
    return sorted(p.relative_to(folder).as_posix() for p in folder.rglob("*") if not p.is_dir())


def test_links_share_the_bytes_and_copies_do_not(shelf: store.Store, tmp_path: Path) -> None:
    file = put(shelf, "cloud", ".ply")
    lay_out(tmp_path / "run", {"registration/model.ply": file}, copy=False)
    lay_out(tmp_path / "run", {"report/cracks.json": file}, copy=True)
    assert (tmp_path / "run/registration/model.ply").samefile(shelf.path(file))
    copied = tmp_path / "run/report/cracks.json"
    assert copied.read_text() == "cloud" and not copied.samefile(shelf.path(file))


def test_a_second_call_changes_nothing(shelf: store.Store, tmp_path: Path) -> None:
    pages = Folder(entries=(FolderEntry(name="a/index.html", file=put(shelf, "page", ".html")),))
    names = {"report": pages, "model.ply": put(shelf, "cloud", ".ply")}
    for copy in (True, False):
        folder = tmp_path / f"copy-{copy}"
        lay_out(folder, names, copy=copy)
        before = {p: (p.stat().st_ino, p.stat().st_mtime_ns) for p in folder.rglob("*")}
        lay_out(folder, names, copy=copy)
        assert {p: (p.stat().st_ino, p.stat().st_mtime_ns) for p in folder.rglob("*")} == before


def test_new_content_replaces_old_and_stale_names_of_a_folder_go(shelf: store.Store, tmp_path: Path) -> None:
    first = Folder(
        entries=(
            FolderEntry(name="index.html", file=put(shelf, "old", ".html")),
            FolderEntry(name="pictures/one.png", file=put(shelf, "one", ".png")),
        )
    )
    second = Folder(entries=(FolderEntry(name="index.html", file=put(shelf, "new", ".html")),))
    lay_out(tmp_path / "run", {"report": first}, copy=True)
    lay_out(tmp_path / "run", {"report": second}, copy=True)
    assert names_in(tmp_path / "run") == ["report/index.html"]
    assert (tmp_path / "run/report/index.html").read_text() == "new"


def test_a_person_s_edit_of_a_copy_is_undone_and_never_reaches_the_store(
    shelf: store.Store, tmp_path: Path
) -> None:
    file = put(shelf, "page", ".html")
    lay_out(tmp_path, {"index.html": file}, copy=True)
    (tmp_path / "index.html").write_text("edit")
    assert shelf.holds(file)
    lay_out(tmp_path, {"index.html": file}, copy=True)
    assert (tmp_path / "index.html").read_text() == "page"


def test_files_of_others_beside_stay(shelf: store.Store, tmp_path: Path) -> None:
    (tmp_path / "plan.json").write_text("{}")
    lay_out(tmp_path, {"one.mask.png": put(shelf, "1", ".png")}, copy=True)
    lay_out(tmp_path, {"two.mask.png": put(shelf, "2", ".png")}, copy=True)
    assert {"one.mask.png", "plan.json", "two.mask.png"} <= set(names_in(tmp_path))


def test_folders_of_surfaces_that_are_gone_are_removed_when_asked(shelf: store.Store, tmp_path: Path) -> None:
    file = put(shelf, "mosaic", ".tif")
    for name in ("wall-01", "wall-02"):
        lay_out(tmp_path / "mosaics" / name, {"mosaic.tif": file}, copy=False)
    remove_stale(tmp_path / "mosaics", ["wall-02"])
    assert names_in(tmp_path / "mosaics") == ["wall-02/mosaic.tif"]
    assert shelf.holds(file)


def test_no_name_leads_out_of_the_folder(shelf: store.Store, tmp_path: Path) -> None:
    file = put(shelf, "x")
    names = ["../../escape.txt", "/etc/passwd", "a/../../b", "C:\\windows", "", "nul"]
    lay_out(tmp_path / "run", dict.fromkeys(names, file), copy=True)
    assert len(names_in(tmp_path / "run")) == len(names)
    assert not (tmp_path / "escape.txt").exists() and not (tmp_path.parent / "escape.txt").exists()


def test_a_folder_that_someone_made_is_not_overwritten(shelf: store.Store, tmp_path: Path) -> None:
    (tmp_path / "model.ply").mkdir()
    (tmp_path / "model.ply" / "notes.txt").write_text("mine")
    with pytest.raises(OSError, match=r"model\.ply"):
        lay_out(tmp_path, {"model.ply": put(shelf, "cloud", ".ply")}, copy=True)
    assert (tmp_path / "model.ply" / "notes.txt").read_text() == "mine"


def test_a_lost_file_is_told(shelf: store.Store, tmp_path: Path) -> None:
    lost = File(sha256="0" * 64, size=1, suffix=".txt")
    with pytest.raises(FileNotFoundError):
        lay_out(tmp_path / "run", {"lost.txt": lost}, copy=True)


@given(st.text(max_size=300))
def test_any_name_becomes_one_plain_file_name(name: str) -> None:
    safe = safe_name(name)
    assert safe and "/" not in safe and "\\" not in safe and not safe.startswith(".")
    assert safe.isprintable() and safe == safe.strip()
    assert len(safe.encode()) <= LONGEST
    assert safe_name(safe) == safe


@given(st.text(max_size=40), st.text(max_size=40))
def test_two_names_never_become_one(one: str, other: str) -> None:
    assert one == other or safe_name(one) != safe_name(other)
