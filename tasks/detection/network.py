"""A crack's probability at every pixel, by a small network that OpenCV runs.

Ours lies beside this file (hairline.onnx; hairline.md says what it learned from and how well it does). Any
other takes its place that has the same ends: (1, 3, H, W) RGB in 0..1 to (1, 1, H, W) logits, for any H and W
that are multiples of STRIDE.
"""

import hashlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import cv2
import numpy as np
import numpy.typing as npt
from numba import njit

from schemas.problem import BadInput
from schemas.raster import Pixels, Progress, Raster
from tasks.detection.heap import reused
from tasks.detection.sauvola import Mask
from tasks.detection.windows import Window, whole_of, windows

DATA_FILES = ("hairline.onnx",)
OURS = Path(__file__).with_name("hairline.onnx")
SHA256 = "924ced1ebdc90df366caacacd4e94f32edfb3c576049bc6815dd73518b50fbb1"
STRIDE = 32
OCTAVES = (2, 1)  # our network is asked at 1 / 2^octave of the size too
SEEN_PX = 6_000_000  # at once: 120 bytes each (measured)
HALO_PX = 224  # of an octave: what lies further away changes a probability by 1/255 at most (measured)
STEP_PX = STRIDE << 2  # windows begin at multiples of it: so do their pixels at each octave
BAND_PX = 1024  # rows of an image that are read and reduced at once
HALF = 0.5  # what its answer at half size counts where a crack is wide enough to be seen at quarter size
FILL_PX = 63  # what is not known is filled from this far around

Probability = npt.NDArray[np.uint8]  # (H, W): 255 × the probability
Logits = npt.NDArray[np.float32]  # (H, W)


class Limits(NamedTuple):
    """255 × the probability from which a pixel belongs to a crack, and which one pixel of a crack reaches."""

    edge: int
    sure: int


OUR_LIMITS = Limits(77, 115)  # best on the fold not trained on
USUAL_LIMITS = Limits(128, 179)  # of a guest: more likely crack than not; nobody fitted anything to it


class Model(NamedTuple):
    content: bytes  # ONNX
    name: str  # for messages
    at_smaller_sizes: bool = False  # ask it again at half and quarter size, where it sees wide cracks whole
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


class Answer(NamedTuple):
    """What the network says of a window and the halo around it, at 1 / 2^octave of their size."""

    logit: Logits
    top_px: int
    left_px: int
    octave: int

    def at(self, window: Window) -> Logits:
        """Logits of a window inside, at full size."""
        top, bottom = window.top - self.top_px, window.bottom - self.top_px
        left, right = window.left - self.left_px, window.right - self.left_px
        if self.octave == 0:
            return self.logit[top:bottom, left:right]
        step = 1 << self.octave
        y, x = max(0, top // step - 1), max(0, left // step - 1)  # one more on each side, to lie between
        part = self.logit[y : -(-bottom // step) + 1, x : -(-right // step) + 1]
        size = part.shape[1] * step, part.shape[0] * step
        whole = cv2.resize(part, size, interpolation=cv2.INTER_LINEAR)
        return np.asarray(whole[top - y * step : bottom - y * step, left - x * step : right - x * step])


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
    net = _read(model)
    image = whole_of(raster)
    done_px = 0
    with reused():
        for window, wider in _windows(net, raster, image, OCTAVES if model.at_smaller_sizes else (), model):
            valid = raster.valid(*window)
            if valid.any():
                logit = _answer(net, raster, window, 0, model).at(window)
                if wider:
                    quarter, half = (answer.at(window) for answer in wider)
                    _heed(logit, half, quarter)
                yield window, _of_logits(logit, valid)
            done_px += window.area_px
            if on_progress is not None:
                on_progress(done_px / image.area_px)


def _windows(
    net: Any, raster: Raster, of: Window, octaves: tuple[int, ...], model: Model
) -> Iterator[tuple[Window, tuple[Answer, ...]]]:
    """The windows of `of`, each with what the network says of a wider one at each of the octaves."""
    octave = octaves[0] if octaves else 0
    for window in windows(of, whole_of(raster), HALO_PX << octave, SEEN_PX << 2 * octave, STEP_PX):
        if not octaves:
            yield window, ()
        elif raster.valid(*window).any():
            answer = _answer(net, raster, window, octave, model)
            for part, wider in _windows(net, raster, window, octaves[1:], model):
                yield part, (answer, *wider)


@njit(cache=True, nogil=True)
def _sigmoid(logit: np.float32) -> np.float32:
    one, most = np.float32(1.0), np.float32(30.0)
    return np.float32(one / (one + np.exp(-min(max(logit, -most), most))))


@njit(cache=True, nogil=True)
def _heed(logit: Logits, half: Logits, quarter: Logits) -> None:
    """In place: what the network answers at half size, as far as it sees a crack at quarter size."""
    for y in range(logit.shape[0]):
        for x in range(logit.shape[1]):
            share = np.float32(HALF) * _sigmoid(quarter[y, x])
            logit[y, x] += share * (half[y, x] - logit[y, x])


@njit(cache=True, nogil=True)
def _of_logits(logit: Logits, valid: Mask) -> Probability:
    p = np.zeros(logit.shape, dtype=np.uint8)
    for y in range(logit.shape[0]):
        for x in range(logit.shape[1]):
            if valid[y, x]:
                p[y, x] = np.uint8(np.rint(np.float32(255.0) * _sigmoid(logit[y, x])))
    return p


def _answer(net: Any, raster: Raster, window: Window, octave: int, model: Model) -> Answer:
    seen = window.grown(HALO_PX << octave, whole_of(raster))
    return Answer(_logits(net, _reduced(raster, seen, octave), model), seen.top, seen.left, octave)


def _reduced(raster: Raster, window: Window, octave: int) -> Pixels:
    """(H, W, 3) of a window at 1 / 2^octave of its size, what is unknown filled; read band by band."""
    bands: list[Pixels] = []
    for top in range(window.top, window.bottom, BAND_PX):
        bottom = min(window.bottom, top + BAND_PX)
        y0, y1 = max(window.top, top - FILL_PX), min(window.bottom, bottom + FILL_PX)
        read = Window(y0, y1, window.left, window.right)
        rgb = filled(raster.rgb(*read), raster.valid(*read))[top - y0 : bottom - y0]
        down, right = -rgb.shape[0] % (1 << octave), -rgb.shape[1] % (1 << octave)
        even = cv2.copyMakeBorder(rgb, 0, down, 0, right, cv2.BORDER_REFLECT_101)
        size = even.shape[1] >> octave, even.shape[0] >> octave
        small = cv2.resize(even, size, interpolation=cv2.INTER_AREA) if octave else even
        bands.append(np.asarray(small, dtype=np.uint8))
    return np.concatenate(bands)


def filled(rgb: Pixels, valid: Mask) -> Pixels:
    """(H, W, 3): what is not valid takes the mean of what is around it: its rim looks like nothing."""
    if valid.all():
        return rgb
    if not valid.any():
        return np.full_like(rgb, 128)
    size = (FILL_PX, FILL_PX)
    weight = valid.astype(np.float32)
    known = cv2.boxFilter(weight, -1, size, normalize=False, borderType=cv2.BORDER_CONSTANT)
    summed = cv2.boxFilter(rgb * weight[..., None], -1, size, normalize=False, borderType=cv2.BORDER_CONSTANT)
    far = rgb[valid].mean(axis=0)
    near = np.where(known[..., None] > 0.5, summed / np.maximum(known, 1.0)[..., None], far)
    return np.where(valid[..., None], rgb, np.rint(near)).astype(np.uint8)


def _read(model: Model) -> Any:
    try:
        return cv2.dnn.readNetFromONNX(np.frombuffer(model.content, dtype=np.uint8))
    except cv2.error as problem:
        raise _unfit(model, f"cannot be read as an ONNX network ({_first_words(problem)})") from None


def _logits(net: Any, rgb: Pixels, model: Model) -> Logits:
    """(H, W) of (H, W, 3)."""
    height, width = rgb.shape[:2]
    seen = cv2.copyMakeBorder(rgb, 0, -height % STRIDE, 0, -width % STRIDE, cv2.BORDER_REFLECT_101)
    try:
        net.setInput(cv2.dnn.blobFromImage(seen, 1.0 / 255.0))
        logit = np.asarray(net.forward(), dtype=np.float32)
    except cv2.error as problem:
        raise _unfit(model, f"does not run on a tile of an image ({_first_words(problem)})") from None
    if logit.shape != (1, 1, *seen.shape[:2]):
        raise _unfit(model, f"answers a tile of {seen.shape[:2]} px with the shape {logit.shape}")
    return logit[0, 0, :height, :width]


def _unfit(model: Model, what: str) -> BadInput:
    remedy = "Give an ONNX file that turns (1, 3, H, W) RGB in 0..1 into (1, 1, H, W) logits"
    return BadInput(model.name, what, remedy)


def _first_words(problem: cv2.error) -> str:
    return " ".join(str(problem).split())[-120:]
