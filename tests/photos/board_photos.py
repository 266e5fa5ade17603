"""Photos of calibration boards, rendered through OpenCV's own lens models: the truth of these tests.

The code under test undistorts by its own (schemas/distortion.py); these photos are made by OpenCV's."""

from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
Image = npt.NDArray[np.uint8]

SQUARE_TEXELS = 40
FINE, STEP = 2, 8  # rays are traced on every 8th of 2 × 2 points a pixel, linear between


@dataclass(frozen=True)
class Lens:
    width_px: int
    height_px: int
    focal_px: float
    cx_px: float
    cy_px: float
    coefficients: tuple[float, ...]  # as OpenCV orders them: five of Brown's, four of a fisheye's

    @property
    def K(self) -> Array:
        return np.array([[self.focal_px, 0, self.cx_px], [0, self.focal_px, self.cy_px], [0, 0, 1.0]])

    def rays(self, px: Array) -> Array:
        """(N, 3) directions in the camera, z = 1."""
        points, D = px.reshape(-1, 1, 2), np.array(self.coefficients)
        stop = (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_MAX_ITER, 200, 1e-12)
        if len(D) == 4:
            ideal = cv2.fisheye.undistortPoints(points, self.K, D, criteria=stop)
        else:
            ideal = cv2.undistortPoints(points, self.K, D, criteria=stop)
        return np.column_stack([ideal.reshape(-1, 2), np.ones(len(px))])


def chessboard(columns: int = 10, rows: int = 7) -> Image:
    """Squares with a white border of one square."""
    x, y = np.meshgrid(np.arange(columns + 2), np.arange(rows + 2))
    black = ((x + y) % 2 == 0) & (x > 0) & (x <= columns) & (y > 0) & (y <= rows)
    return np.kron(np.where(black, 20, 235), np.ones((SQUARE_TEXELS, SQUARE_TEXELS))).astype(np.uint8)


def charuco(board: cv2.aruco.CharucoBoard) -> Image:
    across, down = board.getChessboardSize()
    size = (across * SQUARE_TEXELS, down * SQUARE_TEXELS)
    drawn = np.asarray(board.generateImage(size, marginSize=0))
    return np.pad(drawn, SQUARE_TEXELS, constant_values=255)


@dataclass(frozen=True)
class BoardPose:
    R: Array  # board to camera
    t: Array  # of the board's middle in the camera, in squares


def tilted(a_deg: float, b_deg: float, c_deg: float, at: tuple[float, float, float]) -> BoardPose:
    """Turned about the camera's x, y and z axes."""
    R, _ = cv2.Rodrigues(np.radians([a_deg, b_deg, c_deg]))
    return BoardPose(np.asarray(R), np.array(at))


def usual_poses(
    lens: Lens, count: int, seed: int, tilt_deg: float = 35.0, fill: float = 0.55
) -> list[BoardPose]:
    """As a careful person takes them: over the whole frame, tilted every way. `fill`: a board of twelve
    squares over the frame's width."""
    rng = np.random.default_rng(seed)
    poses = []
    for k in range(count):
        px = np.array(
            [[(0.22 + 0.56 * (k % 3) / 2) * lens.width_px, (0.25 + 0.5 * (k // 3 % 3) / 2) * lens.height_px]]
        )
        distance = 12 * lens.focal_px / (fill * lens.width_px) * rng.uniform(0.85, 1.25)
        turn = rng.uniform(0, 2 * np.pi)
        tilt = tilt_deg * rng.uniform(0.6, 1.1)
        poses.append(
            tilted(
                tilt * np.cos(turn),
                tilt * np.sin(turn),
                rng.uniform(-15, 15),
                tuple(lens.rays(px)[0] * distance),
            )
        )
    return poses


def photo(
    lens: Lens, board: Image, pose: BoardPose, seed: int, noise: float = 2.0, blur_px: float = 0.6
) -> npt.NDArray[np.uint8]:
    """(H, W, 3): over a grey background, blurred, with noise."""
    columns, rows = lens.width_px * FINE // STEP + 3, lens.height_px * FINE // STEP + 3
    x, y = np.meshgrid((np.arange(columns) - 0.5) * STEP - 0.5, (np.arange(rows) - 0.5) * STEP - 0.5)
    rays = lens.rays(np.column_stack([(x.ravel() + 0.5) / FINE - 0.5, (y.ravel() + 0.5) / FINE - 0.5]))
    normal = pose.R[:, 2]
    depth = (normal @ pose.t) / (rays @ normal)
    on_board = ((rays * depth[:, None] - pose.t) @ pose.R)[:, :2]
    texel = on_board * SQUARE_TEXELS + (np.array(board.shape[::-1]) - 1) / 2
    texel[~(depth > 0)] = -1e4
    coarse = np.clip(texel, -1e4, 1e4).astype(np.float32).reshape(rows, columns, 2)
    full = cv2.resize(coarse, (columns * STEP, rows * STEP), interpolation=cv2.INTER_LINEAR)
    window = (slice(STEP, STEP + lens.height_px * FINE), slice(STEP, STEP + lens.width_px * FINE))
    u, v = np.ascontiguousarray(full[window][..., 0]), np.ascontiguousarray(full[window][..., 1])
    # Linear light averages over a pixel; the board is bright, so its two greys are taken as linear.
    fine = cv2.remap(
        board.astype(np.float32), u, v, cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT, borderValue=90.0
    )
    fine = cv2.GaussianBlur(fine, (0, 0), blur_px * FINE)
    grey = cv2.resize(fine, (lens.width_px, lens.height_px), interpolation=cv2.INTER_AREA)
    rng = np.random.default_rng(seed)
    seen = grey[..., None] * np.array([1.0, 0.97, 0.93]) + rng.normal(0, noise, (*grey.shape, 3))
    return np.clip(np.rint(seen), 0, 255).astype(np.uint8)
