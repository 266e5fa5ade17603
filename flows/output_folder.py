"""The folder that a command or a run writes to."""

import tempfile
from pathlib import Path

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
