"""Corners of a calibration board in a photo: a chessboard of any size, or a ChArUco board."""

import re
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

from schemas.problem import BadInput

Array = npt.NDArray[np.float64]
Grey = npt.NDArray[np.uint8]

SMALLEST = (5, 4)  # inner corners that must be in the photo; whatever is more is found as well
SEARCH_PX = 3.0e6  # larger photos are searched on a smaller copy, their corners refined on themselves
REFINE_SHARE = 0.3  # of the way to the next corner
LEAST_CHARUCO = 8  # corners, not all in one row

Read = Callable[[], Grey]  # a photo, when it is looked at: all of them would not fit into memory
FindBoards = Callable[[Sequence[Read]], "list[Corners | None]"]


@dataclass(frozen=True)
class Corners:
    board: Array  # (N, 2) on the board, in squares; without markers the origin is the photo's own
    px: Array  # (N, 2) in the photo


def find_chessboards(photos: Sequence[Read]) -> list[Corners | None]:
    """Corners of one chessboard of unknown size in each photo; a part of it of 5 × 4 inner corners is enough.

    The search (Duda & Frese 2018) grows from the middle and now and then takes the border for one more row.
    So the board's size is the one found most often, each photo is searched again for just that, and what the
    first search found counts only where it is a part of it."""
    grown = [_chessboard(read(), SMALLEST, cv2.CALIB_CB_LARGER) for read in photos]
    sizes = Counter(_size(corners) for corners in grown if corners is not None)
    if not sizes:
        return grown
    board = max(sizes, key=lambda size: (sizes[size], size))
    found = [_chessboard(read(), board, 0) for read in photos]
    return [whole or _part(corners, board) for whole, corners in zip(found, grown, strict=True)]


def _part(corners: Corners | None, board: tuple[int, int]) -> Corners | None:
    if corners is None:
        return None
    (across, down), smaller = _size(corners), _size(corners) != board
    return corners if smaller and across <= board[0] and down <= board[1] else None


def _size(corners: Corners) -> tuple[int, int]:
    """Inner corners along the longer and the shorter side."""
    across, down = corners.board.max(axis=0).astype(int) + 1
    return max(across, down), min(across, down)


def _chessboard(grey: Grey, size: tuple[int, int], flag: int) -> Corners | None:
    small, scale = _shrunk(grey)
    flags = flag | cv2.CALIB_CB_NORMALIZE_IMAGE
    found, px, meta = cv2.findChessboardCornersSBWithMeta(small, size, flags)
    if not found or (px < 0).any() or (px.reshape(-1, 2) > np.array(small.shape[::-1]) - 1).any():
        return None  # or grown beyond the photo
    rows, columns = meta.shape if flag else size[::-1]
    x, y = np.meshgrid(np.arange(columns, dtype=float), np.arange(rows, dtype=float))
    return _refined(grey, np.column_stack([x.ravel(), y.ravel()]), _at_full_size(px, scale), REFINE_SHARE)


def charuco_finder(squares: tuple[int, int], dictionary: str, marker_share: float) -> FindBoards:
    """Finds any part of a ChArUco board of so many squares across and down. `dictionary` as OpenCV names it,
    with or without DICT_; marker_share: a marker's side over a square's. Raises BadInput."""
    name = "DICT_" + re.sub(r"^DICT_", "", dictionary.upper())
    number = getattr(cv2.aruco, name, None)
    if number is None:
        known = sorted(n.removeprefix("DICT_") for n in dir(cv2.aruco) if n.startswith("DICT_"))
        raise BadInput("--dictionary", f"there is no {dictionary}", f"OpenCV knows {', '.join(known)}")
    if not 0 < marker_share < 1 or min(squares) < 3:
        raise BadInput(
            "--charuco",
            f"{squares[0]}x{squares[1]} squares with markers of {marker_share:g} of their side are no board",
            "Give at least 3x3 squares, and a share between 0 and 1",
        )
    detectors = []
    for before_4_6 in (False, True):  # OpenCV 4.6 swapped the first square of boards with even rows
        board = cv2.aruco.CharucoBoard(squares, 1.0, marker_share, cv2.aruco.getPredefinedDictionary(number))
        board.setLegacyPattern(before_4_6)
        detectors.append(cv2.aruco.CharucoDetector(board))

    def find(grey: Grey) -> Corners | None:
        small, scale = _shrunk(grey)
        best: Corners | None = None
        for detector in detectors:
            corners, ids, _, _ = detector.detectBoard(small)
            if ids is None or len(ids) < LEAST_CHARUCO or (best is not None and len(ids) <= len(best.px)):
                continue
            board = np.asarray(detector.getBoard().getChessboardCorners(), float)[np.ravel(ids), :2]
            if np.linalg.matrix_rank(board - board.mean(axis=0)) == 2:
                best = _refined(grey, board, _at_full_size(corners, scale), (1 - marker_share) / 2)
        return best

    return lambda photos: [find(read()) for read in photos]


def _shrunk(grey: Grey) -> tuple[Grey, float]:
    scale = min(1.0, (SEARCH_PX / grey.size) ** 0.5)
    if scale == 1.0:
        return grey, 1.0
    size = (round(grey.shape[1] * scale), round(grey.shape[0] * scale))
    return np.asarray(cv2.resize(grey, size, interpolation=cv2.INTER_AREA), np.uint8), size[0] / grey.shape[1]


def _at_full_size(corners: npt.ArrayLike, scale: float) -> Array:
    return np.asarray((np.asarray(corners, float).reshape(-1, 2) + 0.5) / scale - 0.5)


def _refined(grey: Grey, board: Array, px: Array, share: float) -> Corners:
    """To a few hundredths of a pixel, on the photo itself, in windows of `share` of the way to the next
    corner: they must see nothing but the corner's own edges."""
    apart = np.linalg.norm(px[:, None] - px[None], axis=2)
    np.fill_diagonal(apart, np.inf)
    half = int(np.clip(share * np.median(apart.min(axis=1)), 2, 25))
    stop = (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_MAX_ITER, 50, 1e-3)
    refined = cv2.cornerSubPix(grey, px.astype(np.float32).reshape(-1, 1, 2), (half, half), (-1, -1), stop)
    return Corners(board, np.asarray(refined, float).reshape(-1, 2))
