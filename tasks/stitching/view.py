"""A camera above the plane of the mosaic.

Plane frame: u right, v up, w towards the viewer; the surface is w = 0, or the view's relief over it. Metres
where a scale is known, else the units of the first guess. Poses are camera-to-plane, as CameraPose gives them
for the world."""

from dataclasses import dataclass, field, replace

import numpy as np
import numpy.typing as npt

from schemas.camera import Camera
from tasks.stitching.relief import HeightMap

Array = npt.NDArray[np.float64]

# A camera that looks straight at the plane, its top towards v: x → u, y (down) → −v, z (forward) → −w.
FACING = np.diag([1.0, -1.0, -1.0])


@dataclass(frozen=True)
class View:
    camera: Camera
    R: Array  # (3, 3) R_plane_camera: columns are the camera's axes in the plane frame
    C: Array  # (3,) position in the plane frame, C[2] > 0
    roll_px: Array = field(default_factory=lambda: np.zeros(2))  # (2,) rolling shutter: see `rolled`
    relief: HeightMap | None = None  # of the surface over the plane, which does not move with the view

    @property
    def H_plane_photo(self) -> Array:
        """(3, 3): undistorted photo pixels to (u, v) of the flat plane; the third coordinate is negative
        where the ray meets the plane in front of the camera. The rolling shutter is undone in it, as if the
        lens had no distortion: what the two have to do with each other is far below a pixel."""
        height, (a, b) = self.camera.height_px, self.roll_px
        middle = (height - 1) / 2
        still = np.array(
            [[1, -a / height, a / height * middle], [0, 1 - b / height, b / height * middle], [0, 0, 1]]
        )
        return np.asarray(self._H_plane_ideal @ still)

    @property
    def _H_plane_ideal(self) -> Array:
        """(3, 3): pixels without distortion and rolling shutter to (u, v)."""
        u, v, w = self.C
        rays = self.R @ np.linalg.inv(self.camera.K)
        return np.stack([u * rays[2] - w * rays[0], v * rays[2] - w * rays[1], rays[2]])

    def to_plane(self, undistorted_px: npt.ArrayLike) -> Array:
        """(N, 2) points (u, v) of the surface at (N, 2) undistorted pixels; NaN where the ray misses it."""
        px = np.asarray(undistorted_px, dtype=float)
        q = px @ self.H_plane_photo[:, :2].T + self.H_plane_photo[:, 2]
        depth = np.where(q[:, 2] < -1e-9, q[:, 2], np.nan)
        flat = np.asarray(q[:, :2] / depth[:, None])
        return flat if self.relief is None else self.relief.met(flat, self.C)

    def to_undistorted(self, uv: npt.ArrayLike) -> Array:
        """(N, 2) undistorted pixels of (N, 2) plane points; NaN behind the camera."""
        return self._rolled(self._ideal(uv) * self.camera.focal_px + self.camera.principal_px)

    def to_photo(self, uv: npt.ArrayLike, over: npt.ArrayLike = 0.0) -> Array:
        """(N, 2) pixels of the photo as taken, distortion and rolling shutter included, of (N, 2) places so
        high over the surface."""
        ideal = self._ideal(uv, over)
        return self._rolled(self.camera.distort(ideal) * self.camera.focal_px + self.camera.principal_px)

    def _rolled(self, px: Array) -> Array:
        """(N, 2) pixels where a row lies roll_px · rolled(row) farther on than a global shutter shows it."""
        a, b = self.roll_px
        y = (px[:, 1] + b * rolled(0.0, self.camera)) / (1 - b / self.camera.height_px)
        return np.column_stack([px[:, 0] + a * rolled(y, self.camera), y])

    def _ideal(self, uv: npt.ArrayLike, over: npt.ArrayLike = 0.0) -> Array:
        in_camera = self._in_camera(np.asarray(uv, dtype=float), over)
        z = np.where(in_camera[:, 2] > 1e-9, in_camera[:, 2], np.nan)
        return np.asarray(in_camera[:, :2] / z[:, None])

    def _in_camera(self, uv: Array, over: npt.ArrayLike = 0.0) -> Array:
        height = np.zeros(len(uv)) if self.relief is None else self.relief.at(uv)
        points = np.column_stack([uv, height + np.asarray(over, float)])
        return np.asarray((points - self.C) @ self.R)

    @property
    def outline_uv(self) -> Array:
        """(16, 2) footprint on the plane, along the photo's border; NaN where it looks past the plane."""
        right, bottom = self.camera.width_px - 1.0, self.camera.height_px - 1.0
        t = np.linspace(0, 1, 4, endpoint=False)
        zero = np.zeros(4)
        x = np.concatenate([t * right, zero + right, (1 - t) * right, zero])
        y = np.concatenate([zero, t * bottom, zero + bottom, (1 - t) * bottom])
        return self.to_plane(np.column_stack([x, y]))

    @property
    def centre_uv(self) -> Array:
        """(2,) where the middle of the photo meets the plane."""
        middle = [[(self.camera.width_px - 1) / 2, (self.camera.height_px - 1) / 2]]
        return np.asarray(self.to_plane(middle)[0])

    @property
    def units_per_px(self) -> float:
        """Plane units that a pixel covers in the middle of the photo (root of its area)."""
        x, y = (self.camera.width_px - 1) / 2, (self.camera.height_px - 1) / 2
        a, b, c = self.to_plane([[x, y], [x + 1, y], [x, y + 1]])
        return float(np.sqrt(abs(np.linalg.det(np.stack([b - a, c - a])))))

    def moved(self, scale: float, angle_rad: float, shift: Array) -> "View":
        """Under the similarity q → scale · rotation · q + shift of the plane."""
        turn = np.eye(3)
        c, s = np.cos(angle_rad), np.sin(angle_rad)
        turn[:2, :2] = [[c, -s], [s, c]]
        return replace(self, R=turn @ self.R, C=scale * (turn @ self.C) + np.array([shift[0], shift[1], 0.0]))


def rolled(row_px: npt.ArrayLike, camera: Camera) -> Array:
    """−½..½: when a row is exposed, as a share of the readout, the middle one at 0."""
    return np.asarray((np.asarray(row_px, dtype=float) + 0.5) / camera.height_px - 0.5)


def with_lens(camera: Camera, lens: Array) -> Camera:
    """The camera with another lens: ln of its focal length over the camera's, k1, principal point in pixels.
    Not model_copy: it would carry over the cached matrix."""
    log_focal, k1, cx, cy = lens.tolist()
    values = {"focal_px": camera.focal_px * float(np.exp(log_focal)), "k1": k1, "cx_px": cx, "cy_px": cy}
    return Camera.model_validate(camera.model_dump() | values)


def shrunk(view: View, factor: int) -> View:
    """The view of the photo averaged over squares of `factor` pixels."""
    if factor == 1:
        return view
    camera = view.camera
    width, height = max(camera.width_px // factor, 1), max(camera.height_px // factor, 1)
    sx, sy = width / camera.width_px, height / camera.height_px  # the same but for a cut pixel
    cx, cy = camera.principal_px
    values = {
        "width_px": width,
        "height_px": height,
        "focal_px": camera.focal_px * sx,
        "cx_px": (cx + 0.5) * sx - 0.5,
        "cy_px": (cy + 0.5) * sy - 0.5,
    }
    smaller = Camera.model_validate(camera.model_dump() | values)
    return replace(view, camera=smaller, roll_px=view.roll_px * [sx, sy])


def rotation(vector: Array) -> Array:
    """(…, 3, 3) from rotation vectors (…, 3), radians (Rodrigues)."""
    angle = np.linalg.norm(vector, axis=-1)[..., None, None]
    x, y, z = np.moveaxis(vector, -1, 0)
    zero = np.zeros_like(x)
    cross = np.stack([zero, -z, y, z, zero, -x, -y, x, zero], axis=-1).reshape(*x.shape, 3, 3)
    safe = np.maximum(angle, 1e-12)
    turn = np.eye(3) + np.sin(safe) / safe * cross + (1 - np.cos(safe)) / safe**2 * (cross @ cross)
    return np.asarray(turn)


def rotation_vector(R: Array) -> Array:
    """(…, 3) of rotations (…, 3, 3) by less than 180°."""
    twice = np.stack(
        [R[..., 2, 1] - R[..., 1, 2], R[..., 0, 2] - R[..., 2, 0], R[..., 1, 0] - R[..., 0, 1]], axis=-1
    )
    sine = np.linalg.norm(twice, axis=-1) / 2
    cosine = (np.trace(R, axis1=-2, axis2=-1) - 1) / 2
    angle = np.arctan2(sine, cosine)
    return np.asarray(twice * (angle / np.maximum(2 * sine, 1e-12))[..., None])
