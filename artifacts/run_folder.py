"""The folder of a run as people read it: the store's objects under names that say what they are."""

import hashlib
import re
import shutil
from collections.abc import Collection, Mapping
from pathlib import Path

from artifacts import store
from artifacts.whole_file import whole
from schemas.file import File, Folder

LONGEST = 100  # bytes of a name; file systems stop at 255
RESERVED = {"con", "prn", "aux", "nul", *(f"{device}{n}" for device in ("com", "lpt") for n in range(1, 10))}


def lay_out(folder: Path, names: Mapping[str, File | Folder], copy: bool) -> None:
    """Make `folder` hold each of `names` ("/" between its parts): a link into the store, or a real copy.

    What is there already stays untouched, so that a second call does nothing. A `Folder` is mirrored: what
    an earlier run left under its name and it does not hold any more is removed. Names are made safe
    (`safe_name`). FileNotFoundError where the store has lost a file.
    """
    for name, content in names.items():
        target = folder / _safe_path(name)
        if isinstance(content, File):
            _place(content, target, copy)
        else:
            placed = {target / _safe_path(entry.name): entry.file for entry in content.entries}
            _remove_all_but(target, placed.keys())
            for path, file in placed.items():
                _place(file, path, copy)


def remove_stale(folder: Path, names: Collection[str]) -> None:
    """Remove what earlier runs left in `folder`, which is Hairline's alone, under other names than these."""
    keep = {safe_name(name) for name in names}
    for path in folder.iterdir() if folder.is_dir() else ():
        if path.name not in keep:
            _remove(path)


def safe_name(name: str) -> str:
    """One file name for any string: no separators, control characters, leading dots or reserved names.

    A name that had to change carries eight hex digits of the original, so that two never become one."""
    safe = re.sub(r"[^\w .()+=@,-]", "_", name).strip(" ").rstrip(".")
    safe = re.sub(r"^\.+", "_", safe)
    fits = len(safe.encode()) <= LONGEST and safe.split(".")[0].lower() not in RESERVED
    if safe and safe == name and fits:
        return safe
    stem, dot, suffix = safe.rpartition(".") if re.search(r".\.[A-Za-z0-9]{1,5}$", safe) else (safe, "", "")
    mark = hashlib.sha256(name.encode("utf-8", "surrogatepass")).hexdigest()[:8]
    room = LONGEST - len(f"-{mark}{dot}{suffix}")
    stem = stem.encode()[:room].decode(errors="ignore") or "unnamed"
    return f"{stem}-{mark}{dot}{suffix}"


def _safe_path(name: str) -> Path:
    parts = [part for part in name.split("/") if part not in ("", ".")]
    return Path(*(safe_name(part) for part in parts or [name]))


def _place(file: File, target: Path, copy: bool) -> None:
    source = store.current().path(file)
    if _is_placed(file, source, target, copy):
        return
    target.parent.mkdir(parents=True, exist_ok=True)
    with whole(target) as temporary:
        if copy:
            shutil.copyfile(source, temporary)
        else:
            _link(source, temporary)


def _is_placed(file: File, source: Path, target: Path, copy: bool) -> bool:
    if not target.is_file():
        return False
    if not copy:
        return target.samefile(source)
    own = not target.is_symlink() and not target.samefile(source)
    return own and target.stat().st_size == file.size and store.digest(target) == file.sha256


def _link(source: Path, target: Path) -> None:
    try:
        target.hardlink_to(source)  # lives on when the store is deleted
    except OSError:  # another disk
        target.symlink_to(source)


def _remove_all_but(folder: Path, keep: Collection[Path]) -> None:
    if folder.is_symlink() or not folder.is_dir():
        return
    kept_folders = {parent for path in keep for parent in path.parents}
    for path in sorted(folder.rglob("*"), reverse=True):  # children before their folders
        if path not in keep and path not in kept_folders:
            _remove(path)


def _remove(path: Path) -> None:
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path)
    else:
        path.unlink(missing_ok=True)
