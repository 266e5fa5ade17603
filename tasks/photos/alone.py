"""Photos that stand for themselves: one that shows nothing, or the same as another, is not inspected."""

from collections.abc import Sequence

from schemas.photo import Photo
from schemas.problem import BadInput

BLANK = "Shoot it again; where it is a mosaic with blank parts, give it as TIFF with these transparent"


def fit_alone(photos: Sequence[Photo], first: dict[str, str] | None = None) -> tuple[Photo | BadInput, ...]:
    """Each photo, or why no crack can be looked for in it. Blur is judged among photos of one surface alone
    (`sharpness_shares`).

    first: names of photos judged before, by the digest of their files; these are added."""
    first = {} if first is None else first
    return tuple(_fit(photo, first.setdefault(photo.file.sha256, photo.name)) for photo in photos)


def _fit(photo: Photo, twin: str) -> Photo | BadInput:
    if twin != photo.name:
        return BadInput(photo.name, f"the same picture as {twin}", "Nothing to do")
    return BadInput(photo.name, photo.misexposed, BLANK) if photo.misexposed else photo
