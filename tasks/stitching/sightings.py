"""Which mark is seen where: the pixels that were stated, and the tags that are found."""

from collections import Counter
from collections.abc import Callable, Sequence
from pathlib import PurePath

import numpy as np

from schemas.control import Control
from schemas.photo import Photo
from schemas.problem import LeftOut
from tasks.stitching.compositing import Pixels
from tasks.stitching.control import Sightings
from tasks.stitching.tags import find_tags
from tasks.stitching.view import Array


def sightings_in(
    control: Control, photos: list[Photo], read: Callable[[int], Pixels]
) -> tuple[Sightings, tuple[LeftOut, ...]]:
    """Where the photos show the marks, as stated and as tags are found; stated photos that are not there."""

    number = _numbers([photo.name for photo in photos])
    stated = [(m, photo, pixel) for m, seen in control.marks.items() for photo, pixel in seen.items()]
    missing = tuple(
        LeftOut(
            item=f"mark {mark}",
            stage="stitching",
            what=f"there is no readable photo {photo} in this set",
            remedy="Correct the photo's name: with its suffix, and its folder where several are called so",
        )
        for mark, photo, _ in stated
        if photo not in number
    )
    sightings: dict[str, dict[int, Array]] = {}
    for mark, photo, pixel in stated:
        if photo in number:
            sightings.setdefault(mark, {})[number[photo]] = np.asarray(pixel, float)
    if control.tags is not None:
        for i in range(len(photos)):
            for mark, centre in find_tags(read(i), control.tags).items():
                sightings.setdefault(mark, {}).setdefault(i, centre)
    return sightings, missing


def _numbers(names: Sequence[str]) -> dict[str, int]:
    """Of each photo by its name, and by its file's name alone where one photo of these is called so."""
    files = [PurePath(name).name for name in names]
    bearers = Counter(files)
    alone = {file: i for i, file in enumerate(files) if bearers[file] == 1}
    return alone | {name: i for i, name in enumerate(names)}
