"""A file by its content: where it lies is the store's business (artifacts/store.py)."""

from typing import Annotated

from pydantic import StringConstraints

from schemas.contract import Contract


class File(Contract):
    """Content-addressed file. Two files with the same bytes and suffix are the same File."""

    sha256: Annotated[str, StringConstraints(pattern=r"^[0-9a-f]{64}$")]
    size: int  # bytes
    suffix: str  # with the dot, lower case: ".ply"


class FolderEntry(Contract):
    name: str  # path inside the folder, "/" between its parts
    file: File


class Folder(Contract):
    """A folder as the manifest of its files, sorted by name."""

    entries: tuple[FolderEntry, ...]
