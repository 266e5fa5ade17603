"""A camera calibrated from photos of a board, and what it rests on."""

from schemas.camera import Camera
from schemas.contract import Contract, Vector2
from schemas.problem import LeftOut


class BoardView(Contract):
    """One photo of the board."""

    name: str
    corners_px: tuple[Vector2, ...]  # where they were found, in the photo as stored
    residuals_px: tuple[Vector2, ...]  # found less computed
    rms_px: float  # of the residuals' lengths
    tilt_deg: float  # of the board against the image plane


class Calibration(Contract):
    camera: Camera
    sigma: dict[str, float]  # 1σ of each adjusted field of `camera`
    rms_px: float  # over all corners
    undistortion_sigma_px: float  # 1σ of where an undistorted pixel lies, at the worst place between corners,
    extrapolated_sigma_px: float  # and at the worst place of the frame
    covered: float  # share of the frame's cells that hold a corner
    views: tuple[BoardView, ...]
    left_out: tuple[LeftOut, ...] = ()
