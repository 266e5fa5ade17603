"""Rows of cracks as such: how they turn, real ones beside the simulator's; how wide jagged ones, as these
are, are measured to be; and how blurred their photos are."""

from collections.abc import Iterator

import cv2
import numpy as np
import numpy.typing as npt

from schemas.bit_mask import BitMask
from schemas.raster import ArrayRaster
from tasks.measurement.centreline import resample, smooth
from tasks.measurement.measure import measure_cracks
from tasks.measurement.psf import DEFAULT_PX
from tasks.measurement.skeleton import crack_paths
from tests.benchmarks.cracked_walls import PX_M, cracked_wall
from tests.benchmarks.table import Row, absent, row
from tests.development_data import ROOT

CHORDS_PX = (8, 16, 32, 64)
STAIRCASE_PX = 1.5  # σ that takes the staircase of pixels out of a drawn mask's middle
LEAST_PX, GAP_PX = 30.0, 15.0
WIDTHS_PX = (1.2, 1.6, 2.0, 3.0, 4.0)
DEPTH_RMS = 10.0
SEEDS = range(700, 712)

Mask = npt.NDArray[np.bool_]


def turns() -> Iterator[Row]:
    """RMS angle from chord to chord along centrelines, by the chords' length."""
    drawn = [cracked_wall(seed, 4.0, DEPTH_RMS).truth for seed in SEEDS]
    yield from _turns_of(drawn, f"{len(drawn)} simulated walls")
    for name in ("uav", "deepcrack_train"):
        folder = ROOT / "cracks" / name / "masks"
        if not folder.is_dir():
            yield absent("turn from chord to chord", "", f"cracks/{name} is not on this machine")
            continue
        masks = [np.asarray(cv2.imread(str(path), 0)) > 0 for path in sorted(folder.iterdir())]
        yield from _turns_of(masks, f"{len(masks)} masks of {name}")


def _turns_of(masks: list[Mask], data: str) -> Iterator[Row]:
    turned: dict[int, list[float]] = {chord: [] for chord in CHORDS_PX}
    for mask in masks:
        for path in crack_paths(BitMask.of(mask), LEAST_PX, GAP_PX):
            line = resample(smooth(path.points, STAIRCASE_PX), 1.0)
            for chord in CHORDS_PX:
                steps = np.diff(line[::chord], axis=0)
                heading = np.unwrap(np.arctan2(steps[:, 1], steps[:, 0]))
                turned[chord] += np.degrees(np.diff(heading)).tolist()
    for chord, angles in turned.items():
        rms = float(np.sqrt(np.mean(np.square(angles))))
        yield row(f"turn from chord to chord of {chord} px", rms, "° RMS", None, data, None)


def widths() -> Iterator[Row]:
    """Error of a crack's median width, of those that are not said to be upper bounds."""
    for width_px in WIDTHS_PX:
        errors, bounds = [], 0
        for seed in SEEDS:
            wall = cracked_wall(seed, width_px, DEPTH_RMS)
            known = cv2.dilate(wall.truth.astype(np.uint8), np.ones((3, 3), np.uint8)) > 0
            found = measure_cracks(ArrayRaster(wall.rgb), BitMask.of(known), LEAST_PX, GAP_PX).cracks
            crack = max(found, key=lambda one: one.length_px)
            true_px = float(np.median(_middle(wall.crack.left_m + wall.crack.right_m))) / PX_M
            if crack.widths.is_upper_bound:
                bounds += 1
            else:
                errors.append(float(np.median(_middle(crack.widths.width_px))) - true_px)
        what, data, seeds = (
            f"width of a crack of {width_px:g} px",
            f"{len(SEEDS)} simulated walls",
            f"{SEEDS[0]}…",
        )
        yield row(f"{what}: said to be at most", bounds, "walls", None, data, seeds)
        if errors:
            yield row(f"{what}: mean error", float(np.mean(errors)), "px", None, data, seeds)
            yield row(f"{what}: worst error", float(np.abs(errors).max()), "px", None, data, seeds)


def blur() -> Iterator[Row]:
    """σ of the blur of real photos whose cracks are wide enough to tell it."""
    folder = ROOT / "cracks" / "uav"
    if not folder.is_dir():
        yield absent("blur", "", "cracks/uav is not on this machine")
        return
    told = []
    for path in sorted((folder / "images").iterdir()):
        rgb = np.asarray(cv2.imread(str(path), cv2.IMREAD_COLOR_RGB), np.uint8)
        drawn = np.asarray(cv2.imread(str(folder / "masks" / path.name), 0)) > 0
        psf_px = measure_cracks(ArrayRaster(rgb), BitMask.of(drawn), LEAST_PX, GAP_PX).psf_px
        if psf_px != DEFAULT_PX:
            told.append(psf_px)
    for share in (5, 25, 50, 75, 95):
        data = f"{len(told)} photos of uav"
        yield row(f"blur: {share} % have less", float(np.percentile(told, share)), "px", None, data, None)


def _middle(along: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Without the fifth at each end, where a crack tapers."""
    cut = len(along) // 5
    return along[cut:-cut]
