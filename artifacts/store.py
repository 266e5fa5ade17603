"""The content store: files by their SHA-256, written atomically, verified when opened.

`current()` is the store of this process: HAIRLINE_STORE, else runs/.store under the working folder.
"""

import hashlib
import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from artifacts.whole_file import whole
from schemas.file import File, Folder, FolderEntry
from schemas.problem import BadInput

_verified: dict[tuple[str, int, int, int], bool] = {}  # (sha, inode, size, mtime) → same bytes


class Store:
    def __init__(self, root: Path) -> None:
        self.root = root.resolve()

    def _object(self, sha256: str, suffix: str) -> Path:
        return self.root / "objects" / sha256[:2] / f"{sha256}{suffix}"

    def put(self, path: Path, suffix: str | None = None) -> File:
        """Enter a file that stays where it is (reflink or hard link where the disk allows, else a copy), and
        is not written to again. BadInput where it cannot be read."""
        try:
            sha256 = digest(path)
        except OSError as problem:
            raise BadInput(
                path.name,
                f"cannot be read ({problem.strerror})",
                "Give a file that can be read, or leave it out",
            ) from None
        file = File(sha256=sha256, size=path.stat().st_size, suffix=suffix or path.suffix.lower())
        target = self._object(file.sha256, file.suffix)
        if not self.holds(file):
            target.parent.mkdir(parents=True, exist_ok=True)
            with whole(target) as temporary:
                _link_or_copy(path, temporary)
        return file

    def put_folder(self, folder: Path) -> Folder:
        paths = sorted(p for p in folder.rglob("*") if p.is_file())
        return Folder(
            entries=tuple(FolderEntry(name=p.relative_to(folder).as_posix(), file=self.put(p)) for p in paths)
        )

    def path(self, file: File) -> Path:
        """Where the bytes of `file` lie, for reading only. FileNotFoundError where they are lost."""
        if not self.holds(file):
            raise FileNotFoundError(f"{file.sha256}{file.suffix} is not in the store {self.root}")
        return self._object(file.sha256, file.suffix)

    def holds(self, file: File) -> bool:
        """Whether the store has these bytes, unaltered. Hashed once a process per inode, size and mtime."""
        try:
            path = self._object(file.sha256, file.suffix)
            stat = path.stat()
        except OSError:
            return False
        key = (file.sha256, stat.st_ino, stat.st_size, stat.st_mtime_ns)
        if key not in _verified:
            _verified[key] = stat.st_size == file.size and digest(path) == file.sha256
        return _verified[key]

    @contextmanager
    def scratch(self) -> Iterator[Path]:
        """A temporary folder on the store's own disk, so that what is put from it is linked, not copied."""
        parent = self.root / "scratch"
        parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=parent) as folder:
            yield Path(folder)


def current() -> Store:
    return Store(Path(os.environ.get("HAIRLINE_STORE", "runs/.store")))


@contextmanager
def temporary() -> Iterator[Store]:
    """A store for one command, gone when it ends."""
    before = os.environ.get("HAIRLINE_STORE")
    with tempfile.TemporaryDirectory(prefix="hairline-") as folder:
        os.environ["HAIRLINE_STORE"] = folder
        try:
            yield Store(Path(folder))
        finally:
            if before is None:
                del os.environ["HAIRLINE_STORE"]
            else:
                os.environ["HAIRLINE_STORE"] = before


def digest(path: Path) -> str:
    """SHA-256 of a file's bytes, as 64 hex digits."""
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


def _link_or_copy(source: Path, target: Path) -> None:
    try:
        os.link(source, target)
    except OSError:  # other disk, or a file system without links
        shutil.copyfile(source, target)
