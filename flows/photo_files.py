"""The photos in a folder, and what else is there that looks like photos and is not taken."""

from collections import Counter
from collections.abc import Collection
from pathlib import Path
from typing import NamedTuple

from artifacts.geotiff import made_here
from schemas.problem import BadInput, LeftOut

PHOTO_SUFFIXES = {".jpg", ".jpeg", ".png", ".bmp", ".tif", ".tiff", ".heic", ".heif"}
OTHER_PICTURES = {
    ".arw", ".avif", ".cr2", ".cr3", ".dng", ".gif", ".jp2", ".jxl", ".nef", ".orf", ".psd", ".raf", ".raw",
    ".rw2", ".webp",
}  # fmt: skip
REMEDY = f"Put {', '.join(sorted(PHOTO_SUFFIXES))} files there"
COLOURS = 3
MASK = ".mask.png"  # of a picture beside it: `hairline detect` writes these


class PhotoFiles(NamedTuple):
    paths: list[Path]
    not_taken: tuple[LeftOut, ...]  # folders and pictures of other kinds


def photo_files(
    folder: Path, stated: str, *, others: Collection[Path] = (), mosaics: bool = False
) -> PhotoFiles:
    """Sorted by name; BadInput where there is none.

    stated: the folder as the user knows it. others: folders that are looked into besides. mosaics: where
    there is no photo, Hairline's own mosaics are taken; among photos they never are: they show these.
    """
    there = [path for path in sorted(folder.iterdir()) if not is_hidden(path.name)] if folder.is_dir() else []
    masks = {folder / f"{name}{MASK}" for path in there for name in (path.name, path.stem)}
    found = [path for path in there if _is_photo(path) and path not in masks]
    channels = {path: made_here(path) for path in found if path.suffix.lower() in (".tif", ".tiff")}
    paths = [path for path in found if channels.get(path) is None]
    if mosaics and not paths:
        paths = [path for path in found if channels.get(path) == COLOURS]
    not_taken = (*_other_pictures(there, paths, stated), *_folders(there, others, stated))
    if not paths:
        beside = "".join(f"; {one.item}: {one.what}" for one in not_taken)
        own = "; Hairline's own mosaics are none" if found else ""
        raise BadInput(stated, f"holds no photo{own}{beside}", REMEDY)
    return PhotoFiles(paths, not_taken)


def is_hidden(name: str) -> bool:
    """As .thumbnails, ._DJI_0001.JPG (macOS) and @eaDir (Synology) are: made by programs, not by cameras."""
    return name.startswith((".", "@"))


def _is_photo(path: Path) -> bool:
    """Also a link to nothing: it is named among what is left out, not passed over."""
    return path.suffix.lower() in PHOTO_SUFFIXES and (path.is_file() or path.is_symlink())


def _other_pictures(there: list[Path], taken: list[Path], stated: str) -> list[LeftOut]:
    """One for each kind; not those that a camera wrote beside a photo that is taken (RAW and JPEG)."""
    stems = {path.stem for path in taken}
    kinds = Counter(
        path.suffix[1:].upper()
        for path in there
        if path.suffix.lower() in OTHER_PICTURES and path.stem not in stems and path.is_file()
    )
    return [
        LeftOut(
            item=f"{count} {kind} in {stated}",
            stage="photos",
            what="pictures of a kind that is not read",
            remedy="Convert them to JPEG, PNG or TIFF",
        )
        for kind, count in sorted(kinds.items())
    ]


def _folders(there: list[Path], others: Collection[Path], stated: str) -> list[LeftOut]:
    """Those that hold photos."""
    return [
        LeftOut(
            item=f"{path.name} in {stated}",
            stage="photos",
            what="a folder with photos, not looked into",
            remedy="Name it too, or move its photos",
        )
        for path in there
        if path.is_dir() and path.resolve() not in others and holds_photos(path)
    ]


def holds_photos(folder: Path) -> bool:
    """As a card's DCIM/100MEDIA does; pictures of a run's report lie deeper, its mosaics are our own."""
    there = (path for pattern in ("*", "*/*") for path in folder.glob(pattern))
    return any(
        _is_photo(path)
        and not is_hidden(path.name)
        and not is_hidden(path.parent.name)
        and made_here(path) is None
        for path in there
    )
