"""One answer of those that the network gives at full size, at half of it, and so on.

A wide crack looks like a stain from near and is seen whole at a smaller size; a thin one is seen at full size
alone. So each size heeds that of half of it, as far as that of a quarter sees a crack, which is wide then.
And what is wide at one size but not seen at half of it is no crack: so look the gaps between the stones of a
blurred photo.
"""

from collections.abc import Callable
from typing import NamedTuple

import cv2
import numpy as np
import numpy.typing as npt
from numba import njit

from tasks.detection.windows import Window

OCTAVES = (4, 3, 2, 1)  # the network is asked at 1 / 2^octave of the size too
# What the answer at half the size counts where it is surer of a crack that is seen at a quarter, and where it
# is less sure.
SURER, LESS_SURE = 0.9, 0.5
WIDE_PX = 11  # across: so wide a crack is seen at half the size too
MARGIN_PX = 16  # to look for what is wide
BAND_ROWS = 256  # of an answer that are joined at once: bounds the memory

Logits = npt.NDArray[np.float32]  # (H, W)
Kept = npt.NDArray[np.float16] | Logits
Levels = npt.NDArray[np.uint8]  # (H, W): 255 × the probability


class Answer(NamedTuple):
    """What the network says of a part of an image at 1 / 2^octave of its size."""

    alone: Kept
    joined: Kept  # with what it says at smaller sizes
    top_px: int  # of the part, at full size
    left_px: int
    octave: int

    @property
    def window(self) -> Window:
        """Where it lies, at its size."""
        top, left = self.top_px >> self.octave, self.left_px >> self.octave
        height, width = self.alone.shape
        return Window(top, top + height, left, left + width)

    def within(self, window: Window) -> "Answer":
        """Its part in a window, at its size."""
        part = window.inside(self.window)
        top_px, left_px = window.top << self.octave, window.left << self.octave
        return Answer(self.alone[part], self.joined[part], top_px, left_px, self.octave)

    def compact(self) -> "Answer":
        """In half the memory: off by less than a thousandth of a probability."""
        return self._replace(alone=self.alone.astype(np.float16), joined=self.joined.astype(np.float16))

    def joined_at(self, finer: "Answer") -> Logits:
        """The joined logits where a finer answer lies, at its size."""
        return self._enlarged(finer, lambda rows, columns: self.joined[rows, columns])

    def probable_at(self, finer: "Answer") -> Logits:
        """The probabilities of a crack there."""
        return self._enlarged(
            finer, lambda rows, columns: _probable(self.joined[rows, columns].astype(np.float32))
        )

    def likeliest_at(self, finer: "Answer") -> Logits:
        """The larger of the logits alone and joined there."""
        return self._enlarged(
            finer, lambda rows, columns: np.maximum(self.alone[rows, columns], self.joined[rows, columns])
        )

    def _enlarged(self, finer: "Answer", part: Callable[[slice, slice], Kept]) -> Logits:
        step = 1 << (self.octave - finer.octave)
        top = finer.window.top - (self.top_px >> finer.octave)
        left = finer.window.left - (self.left_px >> finer.octave)
        height, width = finer.alone.shape
        y, x = max(0, top // step - 1), max(0, left // step - 1)  # one more on each side, to lie between
        small = part(slice(y, -(-(top + height) // step) + 1), slice(x, -(-(left + width) // step) + 1))
        size = small.shape[1] * step, small.shape[0] * step
        whole = cv2.resize(small.astype(np.float32), size, interpolation=cv2.INTER_LINEAR)
        top, left = top - y * step, left - x * step
        return np.asarray(whole[top : top + height, left : left + width])


def join(alone: Answer, wider: tuple[Answer, ...]) -> Answer:
    """An answer with those of smaller sizes around it, the smallest first."""
    if not wider:
        return alone
    joined, whole = np.empty(alone.alone.shape, np.float32), alone.window
    for top in range(whole.top, whole.bottom, BAND_ROWS):
        band = whole._replace(top=top, bottom=min(whole.bottom, top + BAND_ROWS))
        seen = band.grown(MARGIN_PX, whole)
        joined[band.inside(whole)] = _joined(alone.within(seen), wider)[band.inside(seen)]
    return alone._replace(joined=joined)


def _joined(alone: Answer, wider: tuple[Answer, ...]) -> Logits:
    logit = alone.alone.astype(np.float32)
    if len(wider) > 1:
        _heed(logit, wider[-1].joined_at(alone), wider[-2].probable_at(alone))
    _doubt(logit, wider[-1].likeliest_at(alone), _wide(levels(logit)))
    return logit


def _wide(p: Levels) -> Levels:
    """That of what is at least WIDE_PX wide; of what is thinner little is left."""
    return np.asarray(cv2.morphologyEx(p, cv2.MORPH_OPEN, np.ones((WIDE_PX, WIDE_PX), np.uint8)), np.uint8)


def _probable(logit: Logits) -> Logits:
    # As one row: OpenCV takes a (4, 1) array for a number of four channels.
    return np.asarray(cv2.divide(1.0, 1.0 + cv2.exp(-logit.reshape(1, -1))), np.float32).reshape(logit.shape)


def levels(logit: Logits) -> Levels:
    """255 × the probability."""
    return np.asarray(cv2.convertScaleAbs(_probable(logit), alpha=255.0), np.uint8)


@njit(cache=True, nogil=True)
def _heed(logit: Logits, half: Logits, quarter: Logits) -> None:
    """In place: what half the size says, as far as a quarter of it sees a crack (0..1)."""
    for y in range(logit.shape[0]):
        for x in range(logit.shape[1]):
            more = half[y, x] - logit[y, x]
            share = np.float32(SURER if more > 0 else LESS_SURE)
            logit[y, x] += share * quarter[y, x] * more


@njit(cache=True, nogil=True)
def _doubt(logit: Logits, half: Logits, wide: Levels) -> None:
    """In place: no more than half the size says, as far as it is wide (0..255)."""
    for y in range(logit.shape[0]):
        for x in range(logit.shape[1]):
            if wide[y, x] > 0 and half[y, x] < logit[y, x]:
                share = np.float32(wide[y, x]) / np.float32(255.0)
                logit[y, x] += share * (half[y, x] - logit[y, x])
