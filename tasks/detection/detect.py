"""Cracks of one image by the method that the settings name."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from schemas.bit_mask import BitMask
from schemas.detection import Peaks
from schemas.raster import ArrayRaster, Pixels, Progress, Raster
from schemas.settings import DetectSettings
from tasks.connected import Marked, Part, at_least
from tasks.detection.candidates import Scored, candidates
from tasks.detection.components import long_and_thin
from tasks.detection.edges import without_soft
from tasks.detection.global_threshold import PAPER, Histogram, darker_than, from_peaks, otsu
from tasks.detection.half_size import HalfSize, seen_at_half_size
from tasks.detection.joints import Joint, without_joints
from tasks.detection.network import Model, our_model, probabilities
from tasks.detection.paper import paper_mask
from tasks.detection.ridge import SEED, Scale, dark_levels
from tasks.detection.sauvola import Mask, grey_of
from tasks.detection.windows import Window, by_windows

WINDOW_PX = 63  # N: best on our development photos (METHOD); holds cracks of up to half of it, 31 px
WORTH_SAYING = 0.1  # a rejected candidate with a lower score is not worth a line
JOINT_LENGTHS = 8.0  # what is straight over this many times the least length of a crack is a joint


@dataclass(frozen=True)
class DetectionArrays:
    bits: BitMask  # True on cracks
    inspected_px: int
    joints: tuple[Joint, ...] = ()  # straight lines that are dark but no cracks
    stains: tuple[tuple[float, float], ...] = ()  # where something dark has soft edges, x, y
    scores: tuple[Scored, ...] = ()  # of the cracks, by a network
    doubtful: tuple[Scored, ...] = ()  # long enough, but with a score below the settings' least

    @property
    def mask(self) -> Mask:
        """(H, W), of an image that fits in memory."""
        return self.bits.whole()


def detect_image(
    rgb: Pixels,
    valid: Mask | None,
    settings: DetectSettings,
    gsd_mm_px: float | None,
    peaks: Peaks | None = None,
    model: Model | None = None,
) -> DetectionArrays:
    """Cracks of an image in memory. rgb: (H, W, 3) uint8; valid: (H, W), None where all of it is.

    peaks: of the red channel; the methods `paper` and `global` use them where they are known.
    model: of the method `onnx`."""
    return detect_raster(ArrayRaster(rgb, valid), settings, gsd_mm_px, peaks or Peaks(), model=model)


def detect_raster(
    raster: Raster,
    settings: DetectSettings,
    gsd_mm_px: float | None,
    peaks: Peaks,
    on_progress: Progress | None = None,
    model: Model | None = None,
) -> DetectionArrays:
    """Cracks of an image of any size, read piece by piece."""
    least_px = settings.least_px(gsd_mm_px, min(raster.height_px, raster.width_px))
    if settings.method in ("hairline", "onnx"):
        return _by_network(raster, model or our_model(), settings.min_score, least_px, on_progress)
    window = (settings.window_px or WINDOW_PX) | 1
    if settings.method == "paper":
        mask = paper_mask(raster, peaks, window, settings.k, settings.R, on_progress)
        return DetectionArrays(mask, count_valid(raster))
    if settings.method == "global":
        threshold = settings.global_threshold or from_peaks(red_histogram(raster), peaks)
        return DetectionArrays(global_mask(raster, threshold), count_valid(raster))
    return _ridge(raster, settings, Scale.of_window(window), least_px, on_progress)


def _by_network(
    raster: Raster, model: Model, min_score: float, least_px: float, on_progress: Progress | None
) -> DetectionArrays:
    """What a network holds for cracks, long and likely enough as a whole, less what is soft or straight."""
    parts = (
        at_least(model.limits.edge, p, window.top, window.left)
        for window, p in probabilities(raster, model, on_progress)
    )
    pixels = Marked.gathered(raster.height_px, raster.width_px, parts)
    given = candidates(pixels, model.limits)
    long = (given.found.extent_px >= least_px) & given.found.thin
    likely = given.score >= min_score
    sharp, stains = without_soft(given.found.keep(long & likely), raster, pixels.mask)
    left, joints = without_joints(sharp, JOINT_LENGTHS * least_px, least_px)
    mask = long_and_thin(left, 1, least_px).mask
    return DetectionArrays(
        mask,
        count_valid(raster),
        tuple(joints),
        tuple(stains),
        scores=given.at(given.found.holding(mask.at(given.found.pixels.y, given.found.pixels.x))),
        doubtful=given.at(long & ~likely & (given.score >= WORTH_SAYING)),
    )


def _ridge(
    raster: Raster,
    settings: DetectSettings,
    scale: Scale,
    least_px: float,
    on_progress: Progress | None,
) -> DetectionArrays:
    """What stands out at full size; what of it is wide, at half of it too."""
    told = on_progress or (lambda _: None)
    twice = min(raster.height_px, raster.width_px) > 2 * scale.window
    share = 0.8 if twice else 1.0  # of the work
    kept, joints, stains = _ridges(raster, settings, scale, least_px, lambda f: told(share * f))
    if twice:
        smaller = HalfSize(raster)
        half, _, _ = _ridges(smaller, settings, scale, least_px / 2, lambda f: told(0.8 + 0.2 * f))
        kept = seen_at_half_size(kept, half.mask)
    return DetectionArrays(kept.mask, count_valid(raster), tuple(joints), tuple(stains))


def _ridges(
    raster: Raster,
    settings: DetectSettings,
    scale: Scale,
    least_px: float,
    on_progress: Progress,
) -> tuple[Marked, list[Joint], list[tuple[float, float]]]:
    def dark_in(window: Window, seen: Window) -> Part:
        levels = dark_levels(grey_of(raster.rgb(*seen)), raster.valid(*seen), scale, settings.k, settings.R)
        return at_least(1, levels[window.inside(seen)], window.top, window.left)

    parts = by_windows(raster, scale.halo, dark_in, on_progress)
    dark = Marked.gathered(raster.height_px, raster.width_px, parts)
    kept, stains = without_soft(long_and_thin(dark, SEED, least_px), raster, dark.mask)
    kept, joints = without_joints(kept, JOINT_LENGTHS * least_px, least_px)
    return long_and_thin(kept, SEED, least_px), joints, stains


def baselines(raster: Raster, peaks: Peaks) -> list[tuple[str, BitMask]]:
    """The global thresholds for the report, by name."""
    histogram = red_histogram(raster)
    thresholds = [(f"T = {t}", float(t)) for t in PAPER]
    thresholds += [("from the peaks", from_peaks(histogram, peaks)), ("Otsu", otsu(histogram))]
    return [(name, global_mask(raster, t)) for name, t in thresholds]


def global_mask(raster: Raster, threshold: float) -> BitMask:
    """Valid pixels whose grey level lies below one threshold for the whole image."""
    mask = BitMask(raster.height_px, raster.width_px)

    def fill(window: Window, _: Window) -> None:
        dark = darker_than(grey_of(raster.rgb(*window)), raster.valid(*window), threshold)
        mask.write(window.top, window.left, dark)

    by_windows(raster, 0, fill)
    return mask


def red_histogram(raster: Raster) -> Histogram:
    """(256,) valid pixels of each red level."""

    def levels(window: Window, _: Window) -> npt.NDArray[np.int64]:
        return np.bincount(raster.rgb(*window)[..., 0][raster.valid(*window)], minlength=256)

    histogram: Histogram = np.sum(by_windows(raster, 0, levels), axis=0)
    return histogram


def count_valid(raster: Raster) -> int:
    return sum(by_windows(raster, 0, lambda window, _: int(raster.valid(*window).sum())))
