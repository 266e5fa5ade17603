"""The folder that a command or a run writes to."""

import errno
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from shutil import disk_usage

from schemas.problem import BadInput


def make_output_folder(folder: Path) -> None:
    """BadInput where it cannot be made or written to: told before hours of work, not after."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as problem:
        raise BadInput(
            str(folder), f"cannot be made or written to ({problem.strerror})", "Give another --out"
        ) from None


@contextmanager
def told_when_full(*folders: Path) -> Iterator[None]:
    """BadInput where a disk gets full while something is written to these folders: names the fullest."""
    try:
        yield
    except OSError as problem:
        if problem.errno not in (errno.ENOSPC, errno.EDQUOT):
            raise
        fullest = min(filter(Path.is_dir, folders), key=lambda folder: disk_usage(folder).free)
        what = f"cannot be written to ({problem.strerror})"
        raise BadInput(str(fullest), what, "Free space there, or give another --out") from None
