"""A crack's probability at every pixel, by a small network that OpenCV runs.

Ours lies beside this file (hairline.onnx; hairline.md says what it learned from and how well it does). Any
other takes its place that has the same ends: (1, 3, H, W) RGB in 0..1 to (1, 1, H, W) logits, for any H and W
that are multiples of STRIDE.
"""

import hashlib
from pathlib import Path
from typing import Any, NamedTuple

import cv2
import numpy as np
import numpy.typing as npt
from numba import njit

from schemas.problem import BadInput
from schemas.raster import Pixels, Progress, Raster
from tasks.detection.sauvola import Mask

DATA_FILES = ("hairline.onnx",)
OURS = Path(__file__).with_name("hairline.onnx")
SHA256 = "08a67496a41852c97b5d38bac2ed10a285b4975b8e30f59557c1e5bf7b6080f3"
STRIDE = 32
TILE_PX = 2048
HALO_PX = 224  # of an octave: what lies further away changes a probability by 1/255 at most (measured)
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


def probability(raster: Raster, model: Model, on_progress: Progress | None = None) -> Probability:
    """(H, W) of the whole image, tile by tile; 0 where nothing is known. BadInput for an unfit network."""
    nets = [_read(model) for _ in range(3 if model.at_smaller_sizes else 1)]  # each keeps its size: faster
    height, width = raster.height_px, raster.width_px
    whole = np.zeros((height, width), dtype=np.uint8)
    corners = [(y, x) for y in range(0, height, TILE_PX) for x in range(0, width, TILE_PX)]
    for done, (y, x) in enumerate(corners, start=1):
        bottom, right = min(height, y + TILE_PX), min(width, x + TILE_PX)
        valid = raster.valid(y, bottom, x, right)
        if valid.any():
            window = (y, bottom, x, right)
            logit = _tile(nets[0], raster, window, 0, model)
            if model.at_smaller_sizes:
                _heed(logit, *(_tile(nets[octave], raster, window, octave, model) for octave in (1, 2)))
            _fill(whole[y:bottom, x:right], logit, valid)
        if on_progress is not None:
            on_progress(done / len(corners))
    return whole


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
def _fill(whole: Probability, logit: Logits, valid: Mask) -> None:
    for y in range(logit.shape[0]):
        for x in range(logit.shape[1]):
            p = np.rint(np.float32(255.0) * _sigmoid(logit[y, x]))
            whole[y, x] = np.uint8(p) if valid[y, x] else np.uint8(0)


def _tile(net: Any, raster: Raster, window: tuple[int, int, int, int], octave: int, model: Model) -> Logits:
    """Logits of a window (rows, then columns), seen with its halo at 1 / 2^octave of its size."""
    halo_px = HALO_PX << octave
    top, left = max(0, window[0] - halo_px), max(0, window[2] - halo_px)
    bottom, right = min(raster.height_px, window[1] + halo_px), min(raster.width_px, window[3] + halo_px)
    rgb = filled(raster.rgb(top, bottom, left, right), raster.valid(top, bottom, left, right))
    inner = slice(window[0] - top, window[1] - top), slice(window[2] - left, window[3] - left)
    return _logits(net, rgb, octave, model)[inner]


def filled(rgb: Pixels, valid: Mask) -> Pixels:
    """(H, W, 3): what is not valid takes the mean of what is around it: its rim looks like nothing."""
    if valid.all():
        return rgb
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


def _logits(net: Any, rgb: Pixels, octave: int, model: Model) -> Logits:
    """(H, W) of (H, W, 3), made 2^octave times smaller for the network and its answer as much larger."""
    height, width = rgb.shape[:2]
    step = STRIDE << octave
    seen = cv2.copyMakeBorder(rgb, 0, -height % step, 0, -width % step, cv2.BORDER_REFLECT_101)
    size = seen.shape[1], seen.shape[0]
    if octave:
        seen = cv2.resize(seen, (size[0] >> octave, size[1] >> octave), interpolation=cv2.INTER_AREA)
    try:
        net.setInput(cv2.dnn.blobFromImage(seen, 1.0 / 255.0))
        logit = np.asarray(net.forward(), dtype=np.float32)
    except cv2.error as problem:
        raise _unfit(model, f"does not run on a tile of an image ({_first_words(problem)})") from None
    if logit.shape != (1, 1, *seen.shape[:2]):
        raise _unfit(model, f"answers a tile of {seen.shape[:2]} px with the shape {logit.shape}")
    answer = cv2.resize(logit[0, 0], size, interpolation=cv2.INTER_LINEAR) if octave else logit[0, 0]
    return np.asarray(answer, dtype=np.float32)[:height, :width]


def _unfit(model: Model, what: str) -> BadInput:
    remedy = "Give an ONNX file that turns (1, 3, H, W) RGB in 0..1 into (1, 1, H, W) logits"
    return BadInput(model.name, what, remedy)


def _first_words(problem: cv2.error) -> str:
    return " ".join(str(problem).split())[-120:]
