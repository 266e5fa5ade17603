"""What pattern removal and detection say of a mosaic or an image."""

from schemas.contract import Contract, Vector2
from schemas.file import File


class Peaks(Contract):
    """Dominant peaks of the red channel and what they stand for (paper, eq. 3), grey levels."""

    peaks: tuple[int, ...] = ()
    i_blank: int | None = None  # None: no such area
    i_surface: int | None = None
    i_pattern: int | None = None
    t1: float | None = None  # None: nothing is cut below
    t2: float | None = None  # None: nothing is cut above
    note: str = ""  # what was done where the peaks are not three in the order blank < surface < pattern


class Patterns(Peaks):
    """Stitching markers and blank areas, found and taken out."""

    mask: File  # PNG, 255 where nothing can be inspected: blank, off the surface, covered by a marker
    blank_px: int  # covered by no photo
    outside_px: int  # covered, but beyond the surface's outline
    pattern_px: int  # pixels taken for markers
    inspectable_px: int  # what is left


DRAWN = "given mask"  # the method of a mask that somebody drew or another program made


class Detection(Contract):
    mask: File  # PNG, 0/255, the size of the image
    method: str
    crack_px: int
    inspected_px: int
    rejected: tuple[tuple[Vector2, str], ...] = ()  # position in pixels, and why it is no crack
    scores: tuple[tuple[Vector2, float], ...] = ()  # position, and how likely it is a crack, by a network
    baselines: tuple[tuple[str, File], ...] = ()  # (name, mask) of the global thresholds, where asked for
