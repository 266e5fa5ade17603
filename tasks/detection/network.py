"""A crack's probability at every pixel, by a small network that OpenCV runs.

Ours lies beside this file (hairline.onnx; hairline.md says what it learned from and how well it does). Any
other takes its place that has the same ends: (1, 3, H, W) RGB in 0..1, or what `_folded` makes of the photo,
to (1, 1, H, W) logits, or to (1, 4, H/2, W/2), those of each 2×2 pixels as four channels, for any H and W
that are multiples of STRIDE.
"""

import hashlib
import re
from collections.abc import Iterator
from itertools import product
from pathlib import Path
from typing import Any, NamedTuple

import cv2
import numpy as np
import numpy.typing as npt
from numba import njit

from schemas.problem import BadInput
from schemas.raster import Pixels, Progress, Raster
from tasks.detection.shrunk import Shrunk
from tasks.detection.sizes import MARGIN_PX, OCTAVES, Answer, Logits, join, levels
from tasks.detection.windows import Pieces, Window, grid, whole_of
from tasks.heap import given_back, reused

DATA_FILES = ("hairline.onnx",)
OURS = Path(__file__).with_name("hairline.onnx")
SHA256 = "681e246f5b05a9448bbb6a84e1ff14a57e13964a2bc9a7a2ed101a68a3e93f5f"
STRIDE = 32
# At once, some 126 bytes each (measured): of a large image, of which much else is kept; and of one so small
# that this is all, without any halo.
SEEN_PX, WHOLE_PX = 6_850_000, 12_600_000
# Of an octave: what lies further away changes a probability by 3/255 at most, and one of 100,000 by more than
# 1/255 (measured).
HALO_PX = 192
STEP_PX = STRIDE << OCTAVES[0]  # windows begin at multiples of it: so do their pixels at each octave
MANY = 16  # windows: above, memory is asked for at once and given back at the end, which costs one window
FOLDED = re.compile(r"<Input>[^\[]*\[\d+ x 12 x")  # in OpenCV's description of a network: its channels

Probability = npt.NDArray[np.uint8]  # (H, W): 255 × the probability


class Limits(NamedTuple):
    """255 × the probability from which a pixel belongs to a crack, and which one pixel of a crack reaches."""

    edge: int
    sure: int


OUR_LIMITS = Limits(51, 90)  # so low that faint cracks are found whole; what is none tells the score
USUAL_LIMITS = Limits(128, 179)  # of a guest: more likely crack than not; nobody fitted anything to it


class Model(NamedTuple):
    content: bytes  # ONNX
    name: str  # for messages
    at_smaller_sizes: bool = False  # ask it again at half size and less, where it sees wide cracks whole
    limits: Limits = USUAL_LIMITS


def our_model() -> Model:
    """The network of this repository. BadInput where its file is missing, cut short or altered."""
    remedy = f"Restore it: git checkout {OURS.relative_to(OURS.parents[2])}"
    try:
        content = OURS.read_bytes()
    except OSError as problem:
        raise BadInput(OURS.name, f"cannot be read ({problem.strerror})", remedy) from None
    if hashlib.sha256(content).hexdigest() != SHA256:
        raise BadInput(OURS.name, "is not the network that this version ships: altered or cut short", remedy)
    return Model(content, OURS.name, at_smaller_sizes=True, limits=OUR_LIMITS)


def probability(raster: Raster, model: Model, on_progress: Progress | None = None) -> Probability:
    """(H, W) of an image that fits in memory; 0 where nothing is known. BadInput for an unfit network."""
    whole = np.zeros((raster.height_px, raster.width_px), dtype=np.uint8)
    for window, part in probabilities(raster, model, on_progress):
        whole[window.top : window.bottom, window.left : window.right] = part
    return whole


def probabilities(
    raster: Raster, model: Model, on_progress: Progress | None = None
) -> Iterator[tuple[Window, Probability]]:
    """The same of an image of any size, window by window; those where nothing is known are left out."""
    image, octaves = whole_of(raster), OCTAVES if model.at_smaller_sizes else ()
    most_px = WHOLE_PX if image.area_px <= WHOLE_PX else SEEN_PX
    rows, columns = grid(image, HALO_PX, most_px, STEP_PX)
    net, many = _Net(model), len(rows) * len(columns) > MANY
    done_px = 0
    with reused():
        if many:  # memory that grows from window to window has holes
            net.logits(np.zeros((_longest(rows), _longest(columns), 3), np.uint8))
        shrunk = Shrunk(raster)
        for window, wider in _windows(net, shrunk, rows, columns, octaves):
            valid = raster.valid(*window)
            if valid.any():
                seen = window.grown(MARGIN_PX, image)
                answer = join(_answer(net, shrunk, window, 0).within(seen), wider).within(window)
                known = np.where(valid, levels(np.asarray(answer.joined, np.float32)), np.uint8(0))
                yield window, known
            done_px += window.area_px
            if on_progress is not None:
                on_progress(done_px / image.area_px)
    del net
    if many:
        given_back()


def _longest(pieces: Pieces) -> int:
    """Of the pieces with their halos, in pixels."""
    (_, end) = pieces[-1]
    return max(min(end, stop + HALO_PX) - max(0, start - HALO_PX) for start, stop in pieces)


def _windows(
    net: "_Net",
    shrunk: Shrunk,
    rows: Pieces,
    columns: Pieces,
    octaves: tuple[int, ...],
    wider: tuple[Answer, ...] = (),
) -> Iterator[tuple[Window, tuple[Answer, ...]]]:
    """Every row with every column, each with what the network says around it at each of the octaves, joined:
    once for each 2^octave × 2^octave windows, which at that size have as many pixels as one at full size."""
    if not octaves:
        yield from ((Window(*row, *column), wider) for row in rows for column in columns)
        return
    together = 1 << octaves[0]
    for high, wide in product(_lots(rows, together), _lots(columns, together)):
        if any(shrunk.raster.valid(*row, *column).any() for row in high for column in wide):
            window = Window(high[0][0], high[-1][1], wide[0][0], wide[-1][1])
            answer = join(_answer(net, shrunk, window, octaves[0]), wider).compact()
            yield from _windows(net, shrunk, high, wide, octaves[1:], (*wider, answer))


def _lots(pieces: Pieces, size: int) -> list[Pieces]:
    return [pieces[k : k + size] for k in range(0, len(pieces), size)]


def _answer(net: "_Net", shrunk: Shrunk, window: Window, octave: int) -> Answer:
    seen = window.grown(HALO_PX << octave, whole_of(shrunk.raster))
    logits = net.logits(shrunk.at(seen, octave))
    return Answer(logits, logits, seen.top, seen.left, octave)


class _Net:
    def __init__(self, model: Model) -> None:
        self.model, self.net = model, _read(model)
        self.folded = FOLDED.search(self.net.dump()) is not None

    def logits(self, rgb: Pixels) -> Logits:
        """(H, W) of (H, W, 3)."""
        height, width = rgb.shape[:2]
        down, right = -height % STRIDE, -width % STRIDE
        seen = np.asarray(cv2.copyMakeBorder(rgb, 0, down, 0, right, cv2.BORDER_REFLECT_101), np.uint8)
        rows, columns = seen.shape[:2]
        pixels = _folded(seen) if self.folded else cv2.dnn.blobFromImage(seen, 1.0 / 255.0)
        try:
            self.net.setInput(pixels)
            logit = np.asarray(self.net.forward(), dtype=np.float32)
        except cv2.error as problem:
            what = f"does not run on a tile of an image ({_first_words(problem)})"
            raise _unfit(self.model, what) from None
        if logit.shape == (1, 4, rows // 2, columns // 2):
            return _unfolded(logit[0])[:height, :width]
        if logit.shape != (1, 1, rows, columns):
            raise _unfit(self.model, f"answers a tile of {(rows, columns)} px with the shape {logit.shape}")
        return logit[0, 0, :height, :width]


def _read(model: Model) -> Any:
    try:
        return cv2.dnn.readNetFromONNX(np.frombuffer(model.content, dtype=np.uint8))
    except cv2.error as problem:
        raise _unfit(model, f"cannot be read as an ONNX network ({_first_words(problem)})") from None


@njit(cache=True, nogil=True)
def _folded(rgb: Pixels) -> npt.NDArray[np.float32]:
    """(1, 12, H / 2 + 1, W / 2 + 1), −1..1, of (H, W, 3), even: a pixel of 0 around it, and each 2×2 of its
    pixels as channels, as PyTorch's PixelUnshuffle has them."""
    height, width = rgb.shape[0] // 2, rgb.shape[1] // 2
    pixels = np.zeros((1, 12, height + 1, width + 1), np.float32)
    for y in range(2 * height):
        for x in range(2):
            for c in range(3):
                row = pixels[0, 4 * c + 2 * (1 - y % 2) + 1 - x, (y + 1) // 2, x:]
                for k in range(width):
                    row[k] = np.float32(rgb[y, 2 * k + x, c]) * np.float32(2.0 / 255.0) - np.float32(1.0)
    return pixels


@njit(cache=True, nogil=True)
def _unfolded(logit: Logits) -> Logits:
    """(2 H, 2 W) of (4, H, W): as ONNX's DepthToSpace, which OpenCV takes ten times as long for."""
    _, height, width = logit.shape
    whole = np.empty((2 * height, 2 * width), np.float32)
    for y in range(height):
        for x in range(width):
            whole[2 * y, 2 * x], whole[2 * y, 2 * x + 1] = logit[0, y, x], logit[1, y, x]
            whole[2 * y + 1, 2 * x], whole[2 * y + 1, 2 * x + 1] = logit[2, y, x], logit[3, y, x]
    return whole


def _unfit(model: Model, what: str) -> BadInput:
    remedy = "Give an ONNX file that turns (1, 3, H, W) RGB in 0..1 into (1, 1, H, W) logits"
    return BadInput(model.name, what, remedy)


def _first_words(problem: cv2.error) -> str:
    return " ".join(str(problem).split())[-120:]
