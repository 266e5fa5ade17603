"""Whose a run's folder is: of one inspection, and of one command at a time."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

from schemas.problem import BadInput

OWNER = ".inspection"  # in the run's folder: its inspection file, seen from there, so that both may move


@contextmanager
def claimed(folder: Path, inspection: str) -> Iterator[None]:
    """The folder is this inspection's from now on, and this command's until the block or the process ends.

    BadInput where it is another's (`refuse_another_s`), or where a command writes to it now."""
    with (folder / OWNER).open("a+b") as stream:
        if not _locked(stream):
            what = "a run that writes to it has not ended yet"
            raise BadInput(_shown(folder), what, "Wait for it, or give another --out")
        refuse_another_s(folder, inspection)
        if _owner(folder) != _seen_from(folder, inspection):
            stream.truncate(0)
            stream.write(os.fsencode(_seen_from(folder, inspection)))
            stream.flush()
        yield


def refuse_another_s(folder: Path, inspection: str) -> None:
    """BadInput where the folder holds the run of another inspection that still exists.

    inspection: path of the file, or demo:bridge, demo:wall."""
    owner = _owner(folder)
    if owner in ("", _seen_from(folder, inspection)):
        return
    if owner.startswith("demo:"):
        shown = owner
    else:
        file = folder / owner
        if not file.is_file():
            return
        shown = _shown(file.resolve())
    remedy = "Give this inspection another 'name', or the command another --out"
    raise BadInput(_shown(folder), f"belongs to {shown}", remedy)


def _locked(stream: BinaryIO) -> bool:
    """Locked by us until it is closed; the system unlocks it for a process that is killed."""
    try:
        import fcntl

        fcntl.flock(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except (ImportError, OSError):  # a system or a disk without locks: two commands are not told apart there
        pass
    return True


def _owner(folder: Path) -> str:
    """Empty where it is nobody's yet."""
    path = folder / OWNER
    return os.fsdecode(path.read_bytes()) if path.is_file() else ""


def _seen_from(folder: Path, inspection: str) -> str:
    if inspection.startswith("demo:"):
        return inspection
    return os.path.relpath(Path(inspection).resolve(), folder.resolve())


def _shown(path: Path) -> str:
    """As a person would type it."""
    return str(path.relative_to(Path.cwd()) if path.is_relative_to(Path.cwd()) else path)
