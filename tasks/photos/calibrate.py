"""Photos of a board become a calibrated camera, or a word on what the photos lack."""

from collections import Counter
from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt

from schemas.calibration import BoardView, Calibration
from schemas.contract import Vector2
from schemas.problem import BadInput, LeftOut
from tasks.photos.boards import Corners, FindBoards, Grey
from tasks.photos.calibration import Lens, Solved, solve, tilt_deg, undistortion_sigma_px
from tasks.photos.intrinsics import QUARTER_TURNS
from tasks.photos.reading import read_photo

LEAST_PHOTOS = 5  # that differ
ALIKE = 0.03  # of the frame's width: boards whose corners all lie closer are the same view
LEAST_TILT_DEG = 15.0  # of at least two boards: seen squarely, size and distance cannot be told apart
CELLS = (8, 6)  # of the frame, across and down
LEAST_COVERED = 0.4  # of them: what no corner shows of the lens is extrapolated
MOST_FOCAL_SIGMA = 0.005  # relative
MOST_SIGMA_PX = 0.5  # of undistortion, anywhere in the frame
ODD = 3.0  # times the median RMS: that photo was moved, blurred, or shows a bent board

HOW_TO = (
    "Take 10 to 20 photos of a flat board with locked focus, near and far, into every corner of the frame,"
    " tilted by 30 to 45° to all sides"
)


def calibrate(photos: Sequence[tuple[str, Path]], find: FindBoards, lens: Lens) -> Calibration:
    """photos: (name, path). Raises BadInput where too few, too similar or not tilted photos show a board, or
    what they say is too uncertain."""
    usable, left_out = _of_one_size(photos)
    (width, height) = usable[0][2]
    found = find([lambda path=path, name=name: _stored(path, name)[0] for name, path, _ in usable])  # type: ignore[misc]
    seen = [(name, corners) for (name, *_), corners in zip(usable, found, strict=True) if corners is not None]
    left_out += [
        _left_out(name, "no board is found in it", "Check that it is whole in the photo, flat and sharp")
        for (name, *_), corners in zip(usable, found, strict=True)
        if corners is None
    ]
    while True:
        _refuse_too_few(len(photos), [corners for _, corners in seen], width)
        solved = _solve([corners for _, corners in seen], width, height, lens)
        rms = np.array([_rms(residual) for residual in solved.residuals])
        odd = rms > ODD * np.median(rms)
        if not odd.any():
            break
        left_out += [
            _left_out(
                name,
                f"its corners are {off:.2f} px off, the median photo's {np.median(rms):.2f} px",
                "Keep the board flat, whole in the photo, and board and camera still",
            )
            for (name, _), off, out in zip(seen, rms, odd, strict=True)
            if out
        ]
        seen = [one for one, out in zip(seen, odd, strict=True) if not out]
    made = _described(solved, seen, left_out)
    _refuse_uncertain(made)
    return made


def _of_one_size(
    photos: Sequence[tuple[str, Path]],
) -> tuple[list[tuple[str, Path, tuple[int, int]]], list[LeftOut]]:
    """The readable photos of the commonest size."""
    readable, left_out = [], []
    for name, path in photos:
        try:
            readable.append((name, path, _stored(path, name)[1]))
        except BadInput as problem:
            left_out.append(LeftOut.because("photos", problem))
    if not readable:
        raise BadInput("photos", "none can be read", "Give JPEG, PNG, BMP or TIFF photos of a board")
    common, _ = Counter(size for *_, size in readable).most_common(1)[0]
    left_out += [
        _left_out(name, f"is {w} × {h} px, the others {common[0]} × {common[1]} px", "One camera at a time")
        for name, _, (w, h) in readable
        if (w, h) != common
    ]
    return [one for one in readable if one[2] == common], left_out


def _stored(path: Path, name: str) -> tuple[Grey, tuple[int, int]]:
    """The photo as the sensor stored it, and its width and height: that is what a camera file describes."""
    decoded = read_photo(path, name)
    if decoded.orientation in (2, 4, 5, 7):
        raise BadInput(name, "is mirrored", "Give the photos as the camera wrote them")
    grey = cv2.cvtColor(decoded.pixels, cv2.COLOR_RGB2GRAY)
    stored = np.ascontiguousarray(np.rot90(grey, QUARTER_TURNS.get(decoded.orientation, 0)))
    return np.asarray(stored, np.uint8), (stored.shape[1], stored.shape[0])


def _refuse_too_few(given: int, boards: Sequence[Corners], width_px: int) -> None:
    distinct: list[Corners] = []
    for board in boards:
        if not any(_alike(board, other, ALIKE * width_px) for other in distinct):
            distinct.append(board)
    if len(distinct) < LEAST_PHOTOS:
        similar = (
            f", {len(boards) - len(distinct)} of them as another does" if len(distinct) < len(boards) else ""
        )
        raise BadInput(
            "photos",
            f"{len(boards)} of {given} show the board{similar}; it takes {LEAST_PHOTOS} that differ",
            HOW_TO,
        )


def _alike(one: Corners, other: Corners, within_px: float) -> bool:
    return len(one.px) == len(other.px) and bool(np.abs(one.px - other.px).max() < within_px)


def _solve(boards: Sequence[Corners], width_px: int, height_px: int, lens: Lens) -> Solved:
    try:
        return solve(boards, width_px, height_px, lens)
    except np.linalg.LinAlgError:
        other = "without --fisheye" if lens == "fisheye" else "with --fisheye, if the lens is one"
        raise BadInput("photos", "no camera explains these boards", f"{HOW_TO}; or try {other}") from None


def _described(solved: Solved, seen: Sequence[tuple[str, Corners]], left_out: list[LeftOut]) -> Calibration:
    width, height = solved.camera.width_px, solved.camera.height_px
    every = np.concatenate([corners.px for _, corners in seen])
    cell = np.clip((every + 0.5) / (width, height) * CELLS, 0, np.array(CELLS) - 1).astype(int)
    sigma = np.sqrt(np.diag(solved.covariance))
    places, sigma_px = undistortion_sigma_px(solved)
    hull = cv2.convexHull(every.astype(np.float32))
    between = [cv2.pointPolygonTest(hull, (float(x), float(y)), measureDist=False) >= 0 for x, y in places]
    return Calibration(
        camera=solved.camera,
        sigma={name: float(s) for name, s in zip(solved.names, sigma, strict=True)},
        rms_px=_rms(np.concatenate(solved.residuals)),
        undistortion_sigma_px=float(sigma_px[between].max(initial=0.0)),
        extrapolated_sigma_px=float(sigma_px.max()),
        covered=len(np.unique(cell, axis=0)) / (CELLS[0] * CELLS[1]),
        views=tuple(
            BoardView(
                name=name,
                corners_px=_pairs(corners.px),
                residuals_px=_pairs(-residual),
                rms_px=_rms(residual),
                tilt_deg=tilt_deg(pose),
            )
            for (name, corners), residual, pose in zip(seen, solved.residuals, solved.poses, strict=True)
        ),
        left_out=tuple(left_out),
    )


def _refuse_uncertain(made: Calibration) -> None:
    tilts = sorted(view.tilt_deg for view in made.views)
    if tilts[-2] < LEAST_TILT_DEG:
        raise BadInput(
            "photos",
            f"the boards are tilted by at most {tilts[-1]:.0f}°, which leaves the focal length open",
            HOW_TO,
        )
    if made.covered < LEAST_COVERED:
        raise BadInput(
            "photos",
            f"the boards reach only {made.covered:.0%} of the frame; the rest is not calibrated",
            HOW_TO,
        )
    focal = made.sigma["focal_px"] / made.camera.focal_px
    if focal > MOST_FOCAL_SIGMA or made.undistortion_sigma_px > MOST_SIGMA_PX:
        raise BadInput(
            "photos",
            f"they leave the focal length uncertain by {focal:.1%} and undistortion by"
            f" {made.undistortion_sigma_px:.2f} px (1σ; residuals {made.rms_px:.2f} px)",
            HOW_TO,
        )


def _rms(residuals: npt.NDArray[np.float64]) -> float:
    return float(np.sqrt((residuals**2).sum(axis=1).mean()))


def _pairs(values: npt.NDArray[np.float64]) -> tuple[Vector2, ...]:
    return tuple((round(float(x), 4), round(float(y), 4)) for x, y in values)


def _left_out(name: str, what: str, remedy: str) -> LeftOut:
    return LeftOut(item=name, stage="photos", what=what, remedy=remedy)
