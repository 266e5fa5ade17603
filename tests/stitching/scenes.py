"""Small synthetic photo sets of a flat surface, rendered from known cameras: the truth of these tests."""

from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

from schemas.camera import Camera, CameraPose
from schemas.plane import Plane
from schemas.surface import Surface

Array = npt.NDArray[np.float64]

# A wall that faces south (−y): u east, v up, normal towards the viewer.
WALL = Surface(
    name="wall",
    plane=Plane.through((0.0, 0.0, 0.0), (0.0, -1.0, 0.0)),
    origin_m=(0.0, 0.0, 0.0),
    u=(1.0, 0.0, 0.0),
    v=(0.0, 0.0, 1.0),
    outline_m=((0.0, 0.0), (4.0, 0.0), (4.0, 2.5), (0.0, 2.5)),
    hull_m=((0.0, 0.0), (4.0, 0.0), (4.0, 2.5), (0.0, 2.5)),
    area_m2=10.0,
)


@dataclass(frozen=True)
class Texture:
    """Linear light of the wall; pixel (x, y) lies at u = x·m_px, v = top − y·m_px."""

    linear: npt.NDArray[np.float32]
    m_px: float
    left_m: float
    top_m: float


def concrete(seed: int = 0, m_px: float = 0.0015, contrast: float = 0.12) -> Texture:
    """Noise with the falling spectrum of concrete, over the wall and 1 m around it."""
    rng = np.random.default_rng(seed)
    width, height = round(6.0 / m_px), round(4.5 / m_px)
    total = np.zeros((height, width), np.float32)
    for octave in range(1, 8):
        step = 2**octave
        coarse = rng.standard_normal((height // step + 3, width // step + 3)).astype(np.float32)
        fine = cv2.resize(coarse, None, fx=step, fy=step, interpolation=cv2.INTER_CUBIC)
        total += fine[:height, :width] * step**0.4
    total += rng.standard_normal(total.shape).astype(np.float32)
    total = cv2.GaussianBlur(total, (0, 0), 0.8)
    total = (total - total.mean()) / total.std()
    return Texture(np.clip(0.3 * (1 + contrast * 2 * total), 0.02, 0.95), m_px, -1.0, 3.5)


def plane_points(camera: Camera, pose: CameraPose, px: Array) -> Array:
    """(N, 2) points (u, v) of the wall that (N, 2) photo pixels show."""
    rays = camera.back_project(px, pose)
    origin = np.asarray(pose.position_m)
    return WALL.to_surface(origin - rays * (origin[1] / rays[:, 1])[:, None])[:, :2]


def render(
    texture: Texture,
    camera: Camera,
    pose: CameraPose,
    gain: float = 1.0,
    noise: float = 1.5,
    seed: int = 0,
    blur_px: float = 0.6,
) -> npt.NDArray[np.uint8]:
    """(H, W, 3) sRGB photo: traced at twice the resolution through the lens, area-averaged, noise added."""
    ss, step = 2, 8  # rays are traced on every 8th fine pixel and interpolated: off by 0.003 px
    columns, rows = camera.width_px * ss // step + 3, camera.height_px * ss // step + 3
    x, y = np.meshgrid((np.arange(columns) - 0.5) * step - 0.5, (np.arange(rows) - 0.5) * step - 0.5)
    taken = np.column_stack([(x.ravel() + 0.5) / ss - 0.5, (y.ravel() + 0.5) / ss - 0.5])
    uv = plane_points(camera, pose, taken)
    on_texture = (uv - [texture.left_m, texture.top_m]) * [1, -1] / texture.m_px
    coarse = on_texture.reshape(rows, columns, 2).astype(np.float32)
    full = cv2.resize(coarse, (columns * step, rows * step), interpolation=cv2.INTER_LINEAR)
    window = (slice(step, step + camera.height_px * ss), slice(step, step + camera.width_px * ss))
    u, v = np.ascontiguousarray(full[window][..., 0]), np.ascontiguousarray(full[window][..., 1])
    fine = cv2.remap(texture.linear, u, v, cv2.INTER_CUBIC, borderMode=cv2.BORDER_REFLECT)
    fine = cv2.GaussianBlur(fine, (0, 0), blur_px * ss)
    linear = np.clip(
        cv2.resize(fine, (camera.width_px, camera.height_px), interpolation=cv2.INTER_AREA) * gain, 0, 1
    )
    srgb = np.where(linear <= 0.0031308, linear * 12.92, 1.055 * linear ** (1 / 2.4) - 0.055) * 255
    rng = np.random.default_rng(seed)
    tinted = srgb[..., None] * np.array([1.0, 0.98, 0.95]) + rng.normal(0, noise, (*srgb.shape, 3))
    return np.clip(np.rint(tinted), 0, 255).astype(np.uint8)


def grid_poses(
    camera: Camera, columns: int, rows: int, stand_off_m: float, overlap: float, seed: int
) -> list[CameraPose]:
    """A raster over the wall, flown with 5 cm and 1.5° of jitter."""
    rng = np.random.default_rng(seed)
    width, height = camera.footprint_m(stand_off_m)
    poses = []
    for r in range(rows):
        for c in range(columns):
            at = np.array([0.6 + c * width * (1 - overlap), -stand_off_m, 0.5 + r * height * (1 - overlap)])
            x, y, z = at + rng.normal(0, 0.05, 3)
            yaw, pitch, roll = rng.normal(0, 1.5, 3)
            poses.append(CameraPose(position_m=(x, y, z), yaw_deg=yaw, pitch_deg=pitch, roll_deg=roll))
    return poses


def reported(poses: list[CameraPose], sigma_m: float, seed: int) -> list[CameraPose]:
    """What a vehicle says of them: level, facing the wall, each position off by sigma_m."""
    rng = np.random.default_rng(seed)
    said = []
    for pose in poses:
        x, y, z = np.asarray(pose.position_m) + rng.normal(0, sigma_m, 3)
        said.append(CameraPose(position_m=(x, y, z), yaw_deg=0.0, pitch_deg=0.0))
    return said
