"""A camera from photos of a board (Zhang 2000): focal length, principal point and distortion, each with what
it is uncertain by.

Unknowns shared by all photos: f, cx, cy and the coefficients of the lens; six of each photo's own: the
board's turn and place. Pixels are square (one f), as on every sensor of today. Gauss-Newton with
Levenberg's damping; each photo's unknowns are eliminated, so the cost is linear in photos."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import cv2
import numpy as np
import numpy.typing as npt

from schemas.camera import Camera
from tasks.photos.boards import Corners

Array = npt.NDArray[np.float64]
Lens = Literal["brown", "fisheye"]

COEFFICIENTS = {"brown": ("k1", "k2", "p1", "p2", "k3"), "fisheye": ("k1", "k2", "k3", "k4")}
FOCALS = np.geomspace(0.25, 8.0, 17)  # of the longer side: where the search begins
STEPS = 100
DONE = 1e-10  # relative change of the sum of squares


@dataclass(frozen=True)
class Pose:
    """Board to camera, the board's squares being the unit."""

    R: Array  # (3, 3)
    t: Array  # (3,)


@dataclass(frozen=True)
class Solved:
    camera: Camera
    poses: tuple[Pose, ...]
    residuals: tuple[Array, ...]  # (N, 2) of each photo, computed less found, px
    covariance: Array  # of `names`
    names: tuple[str, ...]  # fields of the camera


def solve(boards: Sequence[Corners], width_px: int, height_px: int, lens: Lens) -> Solved:
    """Least squares of the corners' residuals. Raises numpy.linalg.LinAlgError where photos do not tell."""
    camera, poses = _first(boards, width_px, height_px, lens)
    names = ("focal_px", "cx_px", "cy_px", *COEFFICIENTS[lens])
    system = _normal(camera, poses, boards, names)
    if system is None:
        raise np.linalg.LinAlgError("a corner lies behind the camera")
    damping = 1e-3
    for _ in range(STEPS):
        shared, own = system.step(damping)
        moved = _moved(camera, names, shared)
        placed = [_turned(pose, six) for pose, six in zip(poses, own, strict=True)]
        tried = _normal(moved, placed, boards, names) if moved is not None else None
        if moved is None or tried is None or not tried.cost < system.cost:
            damping *= 10
            if damping > 1e10:
                break
            continue
        done = system.cost - tried.cost < DONE * system.cost
        camera, poses, system, damping = moved, placed, tried, max(damping / 10, 1e-12)
        if done:
            break
    return Solved(camera, tuple(poses), system.residuals, system.covariance, names)


def undistortion_sigma_px(solved: Solved) -> tuple[Array, Array]:
    """(M, 2) places of a grid over the frame and (M,) 1σ of undistortion there, in pixels of the photo: what
    of the uncertainty of principal point and coefficients shows in an undistorted photo."""
    camera = solved.camera
    x, y = np.meshgrid(np.linspace(0, camera.width_px - 1, 9), np.linspace(0, camera.height_px - 1, 7))
    px = np.column_stack([x.ravel(), y.ravel()])
    ideal = camera.undistort((px - camera.principal_px) / camera.focal_px)
    px, ideal = px[np.isfinite(ideal[:, 0])], ideal[np.isfinite(ideal[:, 0])]  # a fisheye's corners are dark
    sigma = np.sqrt(np.diag(solved.covariance))
    slopes = []
    for k, small in enumerate(1e-3 * sigma):
        change = np.zeros(len(sigma))
        change[k] = small
        moved = _moved(camera, solved.names, change)
        assert moved is not None
        slopes.append((_undistorted(moved, px) - _undistorted(camera, px)) / small)
    J = camera.distortion.slope(ideal) @ np.nan_to_num(np.stack(slopes, axis=2))  # (M, 2, unknowns)
    return px, np.asarray(np.sqrt(np.einsum("mik,kl,mil->m", J, solved.covariance, J)))


def tilt_deg(pose: Pose) -> float:
    """Of the board against the image plane."""
    return float(np.degrees(np.arccos(min(1.0, abs(pose.R[2, 2])))))


def _undistorted(camera: Camera, px: Array) -> Array:
    ideal = camera.undistort((px - camera.principal_px) / camera.focal_px)
    return np.asarray(ideal * camera.focal_px + camera.principal_px)


def _first(boards: Sequence[Corners], width_px: int, height_px: int, lens: Lens) -> tuple[Camera, list[Pose]]:
    """The focal length, of some, with which boards seen by a lens without distortion fit best."""
    best: tuple[float, Camera, list[Pose]] | None = None
    for focal_px in FOCALS * max(width_px, height_px):
        camera = Camera(
            width_px=width_px, height_px=height_px, focal_px=float(focal_px), lens=lens,
            cx_px=(width_px - 1) / 2, cy_px=(height_px - 1) / 2,
        )  # fmt: skip
        placed = [_placed(camera, board) for board in boards]
        poses = [pose for pose in placed if pose is not None]
        if len(poses) < len(boards):
            continue
        off = [_projected(camera, p, b.board) - b.px for p, b in zip(poses, boards, strict=True)]
        cost = float(sum((o**2).sum() for o in off))
        if np.isfinite(cost) and (best is None or cost < best[0]):
            best = cost, camera, poses
    if best is None:
        raise np.linalg.LinAlgError("no focal length fits")
    return best[1], best[2]


def _placed(camera: Camera, corners: Corners) -> Pose | None:
    """Of a plane, from its homography (Collins & Bartoli 2014)."""
    ideal = camera.undistort((corners.px - camera.principal_px) / camera.focal_px)
    seen = np.isfinite(ideal).all(axis=1)
    if seen.sum() < 6:
        return None
    flat = np.column_stack([corners.board[seen], np.zeros(seen.sum())])
    try:
        found, turn, t = cv2.solvePnP(flat, ideal[seen], np.eye(3), None, flags=cv2.SOLVEPNP_IPPE)
    except cv2.error:
        return None
    return Pose(np.asarray(cv2.Rodrigues(turn)[0], float), np.asarray(t, float).ravel()) if found else None


def _projected(camera: Camera, pose: Pose, board: Array) -> Array:
    space = _in_camera(pose, board)
    with np.errstate(all="ignore"):
        ideal = space[:, :2] / np.where(space[:, 2] > 1e-6, space[:, 2], np.nan)[:, None]
    return np.asarray(camera.distort(ideal) * camera.focal_px + camera.principal_px)


def _in_camera(pose: Pose, board: Array) -> Array:
    return np.asarray(board @ pose.R[:, :2].T + pose.t)


def _moved(camera: Camera, names: Sequence[str], change: Array) -> Camera | None:
    values = camera.model_dump()
    values |= {name: values[name] + float(step) for name, step in zip(names, change, strict=True)}
    return Camera.model_validate(values) if values["focal_px"] > 1.0 and np.isfinite(change).all() else None


def _turned(pose: Pose, six: Array) -> Pose:
    turn = np.asarray(cv2.Rodrigues(six[:3])[0])
    return replace(pose, R=turn @ pose.R, t=pose.t + six[3:])


@dataclass(frozen=True)
class Normal:
    """Normal equations, each photo's own six unknowns in their own block."""

    residuals: tuple[Array, ...]
    cost: float
    A: Array  # (n, s, s)
    a: Array  # (n, s)
    B: Array  # (n, s, 6)
    C: Array  # (n, 6, 6)
    c: Array  # (n, 6)

    def reduced(self, damping: float) -> tuple[Array, Array, Array]:
        """Without the photos' own unknowns, of each photo: (n, s, s), (n, s), and the (n, 6, 6) inverses of
        the blocks eliminated."""
        inverses: Array = np.asarray(np.linalg.inv(_damped(self.C, damping)))
        carried = self.B @ inverses
        return (
            np.asarray(_damped(self.A, damping) - carried @ self.B.transpose(0, 2, 1)),
            np.asarray(self.a - np.einsum("nsk,nk->ns", carried, self.c)),
            inverses,
        )

    @property
    def covariance(self) -> Array:
        """(s, s) of the shared unknowns: σ² (JᵀJ)⁻¹, times what the corners of one photo err together.

        A warped board, blur and the lens' own shape shift corners that lie beside each other alike. Were all
        errors independent, each photo's pull on the shared unknowns at the solution had the covariance σ² of
        its share of JᵀJ; by how much the pulls exceed it is told by their χ² over its degrees of freedom."""
        of_each, pulls, _ = self.reduced(0.0)
        photos, unknowns = pulls.shape
        freedom = max(1, sum(2 * len(r) for r in self.residuals) - unknowns - 6 * photos)
        variance = self.cost / freedom
        chi2 = (
            float(np.einsum("ns,nst,nt->", pulls, np.linalg.pinv(of_each, hermitian=True), pulls)) / variance
        )
        together = chi2 / max(1, (photos - 1) * unknowns)
        return np.asarray(np.linalg.inv(of_each.sum(axis=0)) * variance * max(1.0, together))

    def step(self, damping: float) -> tuple[Array, Array]:
        """(s,) and (n, 6) changes of the unknowns."""
        of_each, pulls, inverses = self.reduced(damping)
        shared = -np.linalg.solve(of_each.sum(axis=0), pulls.sum(axis=0))
        own = -np.einsum("nij,nj->ni", inverses, self.c + np.einsum("nsk,s->nk", self.B, shared))
        return shared, own


def _damped(blocks: Array, damping: float) -> Array:
    diagonal = np.einsum("...ii->...i", blocks)
    return np.asarray(blocks + damping * diagonal[..., None] * np.eye(blocks.shape[-1]))


def _normal(
    camera: Camera, poses: Sequence[Pose], boards: Sequence[Corners], names: Sequence[str]
) -> Normal | None:
    """None where a corner would lie behind the camera."""
    residuals, shared, own = [], [], []
    for pose, corners in zip(poses, boards, strict=True):
        residual = _projected(camera, pose, corners.board) - corners.px
        if not np.isfinite(residual).all():
            return None
        by_shared, by_own = _slopes(camera, pose, corners.board, names)
        residuals.append(residual)
        shared.append(by_shared)
        own.append(by_own)
    return Normal(
        residuals=tuple(residuals),
        cost=float(sum((r**2).sum() for r in residuals)),
        A=np.stack([J.T @ J for J in shared]),
        a=np.stack([J.T @ r.ravel() for J, r in zip(shared, residuals, strict=True)]),
        B=np.stack([J.T @ K for J, K in zip(shared, own, strict=True)]),
        C=np.stack([K.T @ K for K in own]),
        c=np.stack([K.T @ r.ravel() for K, r in zip(own, residuals, strict=True)]),
    )


def _slopes(camera: Camera, pose: Pose, board: Array, names: Sequence[str]) -> tuple[Array, Array]:
    """(2N, s) by the shared unknowns and (2N, 6) by the photo's own."""
    space = _in_camera(pose, board)
    inverse = 1.0 / space[:, 2]
    ideal = space[:, :2] * inverse[:, None]
    distorted, focal, zero = camera.distort(ideal), camera.focal_px, np.zeros(len(ideal))
    none = dict.fromkeys(("k1", "k2", "p1", "p2", "k3", "k4"), 0.0)
    plain = Camera.model_validate(camera.model_dump() | none).distort(ideal)
    columns = [distorted, np.tile([1.0, 0.0], (len(ideal), 1)), np.tile([0.0, 1.0], (len(ideal), 1))]
    for name in names[3:]:  # distortion is linear in its coefficients
        unit = Camera.model_validate(camera.model_dump() | none | {name: 1.0})
        columns.append(focal * (unit.distort(ideal) - plain))
    projection = np.stack(
        [inverse, zero, -ideal[:, 0] * inverse, zero, inverse, -ideal[:, 1] * inverse], axis=1
    ).reshape(-1, 2, 3)
    by_place = focal * camera.distortion.slope(ideal) @ projection
    x, y, z = (space - pose.t).T  # turned about the board's origin
    turning = np.stack([zero, z, -y, -z, zero, x, y, -x, zero], axis=1).reshape(-1, 3, 3)
    by_own = np.concatenate([by_place @ turning, by_place], axis=2)
    return np.stack(columns, axis=2).reshape(-1, len(columns)), by_own.reshape(-1, 6)
