"""What the dominant peaks of the red channel stand for, and the paper's thresholds t1, t2 (eq. 3).

The paper's rule needs three peaks in the order blank < surface < pattern. Real images have more or fewer:
sun and shade give two surface modes, there may be no marker or nothing blank. So here
- blank is known by the coverage mask, never guessed: without blank pixels there is no i_b and no t1, and
  the darkest peak of a photo (its cracks, its shade) is not mistaken for one;
- i_w is the highest of the other peaks;
- i_p needs markers, known by their colour: it is the peak nearest to their red level, if it lies above i_w.
Where i_b ≈ 0, t1 = i_w / 2 takes dark cracks out as well. That is the paper's rule, kept for `paper` alone.
"""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from schemas.detection import Peaks
from tasks.patterns.peaks import dominant_peaks

Histogram = npt.NDArray[np.int64]  # (256,)
BLANK_SHARE = 0.001  # of the pixels: less blank than this makes no peak


class RedHistograms(NamedTuple):
    """Counts of the red channel, level by level: (256,) each."""

    blank: Histogram  # pixels that no photo covers
    surface: Histogram
    markers: Histogram


def paper_thresholds(red: RedHistograms) -> Peaks:
    everything = red.blank + red.surface + red.markers
    peaks = dominant_peaks(everything)
    i_blank, i_pattern = None, None
    others = list(peaks)
    if red.blank.sum() > BLANK_SHARE * everything.sum():
        i_blank = _nearest(others, int(red.blank.argmax()))
        others = [p for p in others if p != i_blank]
    inspectable = red.surface + red.markers
    i_surface = max(others, key=lambda p: int(inspectable[p]), default=None)
    if i_surface is not None and red.markers.any():
        level = int(np.searchsorted(np.cumsum(red.markers), red.markers.sum() / 2))
        i_pattern = _nearest([p for p in others if p > i_surface], level)
    t1 = None if i_blank is None or i_surface is None else (i_blank + i_surface) / 2
    t2 = None if i_pattern is None or i_surface is None else (i_surface + i_pattern) / 2
    return Peaks(
        peaks=peaks,
        i_blank=i_blank,
        i_surface=i_surface,
        i_pattern=i_pattern,
        t1=t1,
        t2=t2,
        note=_note(peaks, i_blank, i_surface, i_pattern, bool(red.markers.any())),
    )


def _nearest(peaks: list[int], level: int) -> int | None:
    return min(peaks, key=lambda p: (abs(p - level), p), default=None)


def _note(
    peaks: tuple[int, ...], i_blank: int | None, i_surface: int | None, i_pattern: int | None, markers: bool
) -> str:
    if i_surface is None:
        return "no peak: nothing to inspect"
    if len(peaks) == 3 and i_blank is not None and i_pattern is not None and i_blank < i_surface < i_pattern:
        return ""
    said = [f"{len(peaks)} peaks where the paper expects three"] if len(peaks) != 3 else []
    if i_blank is None:
        said.append("nothing is blank, so no t1")
    elif i_blank > i_surface:
        said.append("blank is brighter than the surface")
    if i_pattern is None:
        said.append(
            "the markers are no brighter in red than the surface, so no t2: they are masked by their colour"
            if markers
            else "no markers, so no t2"
        )
    return "; ".join(said)
