"""Walls with one crack of known width and depth, for the benchmark of detection. The crack is of the demo's
kind, which the network's training never drew; the wall is rendered through the simulator's camera."""

from dataclasses import dataclass, replace

import cv2
import numpy as np
import numpy.typing as npt

from schemas.camera import Camera, CameraPose
from tasks.simulation.crack import CrackShape, crack
from tasks.simulation.exposure import Motion, expose
from tasks.simulation.face import Face, FaceArrays
from tasks.simulation.grain import power_law
from tasks.simulation.light import LightMap
from tasks.simulation.marks import in_cells, painted_box
from tasks.simulation.sensor import automatic_gain, develop
from tasks.simulation.skin import Skin, fine_grain

SIDE_PX = 640
PX_M = 0.0007
RMS = 0.06  # of ln(brightness) of the concrete
FOCAL_PX = 4000.0
PINK = (0.75, 0.12, 0.42)

Array = npt.NDArray[np.float64]
Pixels = npt.NDArray[np.uint8]
Mask = npt.NDArray[np.bool_]


@dataclass(frozen=True)
class Wall:
    rgb: Pixels
    truth: Mask  # where the crack is
    wide: Mask  # where it is at least `least_px` wide: this much must be found
    shadow_edge: Mask  # within 4 px of the edge of the shadow
    crack: CrackShape


def cracked_wall(
    seed: int,
    width_px: float,
    depth_rms: float,
    *,
    shade: float = 1.0,
    marker: bool = False,
    leaves: bool = False,
    least_px: float = 2.0,
) -> Wall:
    """depth_rms: how much darker the crack is than the wall, in RMS of the wall's texture.
    shade: brightness of one half of the wall against the other, with a hard edge between. leaves: their
    shadows lie on a fifth of it."""
    rng = np.random.default_rng([seed, 0x77616C6C])
    side_m = SIDE_PX * PX_M
    face = Face("wall", (-side_m / 2, 0.0, -side_m / 2), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0), side_m, side_m)
    heading_deg = float(rng.uniform(0, 360))
    along = np.array([np.cos(np.radians(heading_deg)), np.sin(np.radians(heading_deg))])
    start = side_m / 2 - 0.3 * side_m * along
    shape = crack(rng, "c", (float(start[0]), float(start[1])), heading_deg, 0.6 * side_m, width_px * PX_M)
    shape = replace(shape, kept_light=np.full(len(shape.kept_light), 1.0 - min(depth_rms * RMS, 0.95)))
    cells = (int(side_m / (2 * PX_M)) + 2,) * 2
    tone = np.exp(power_law(rng, cells, 2 * PX_M, RMS))[..., None] * np.full(3, 0.35, np.float32)
    shapes = [shape.shapes]
    if marker:
        middle = shape.uv_m[len(shape.uv_m) // 2]
        shapes.append(painted_box(middle, 30.0, (30 * PX_M, 14 * PX_M), PINK))
    grain, grain_texel_m = fine_grain(seed % 8, RMS, 1.0)
    skin = Skin(
        tone.astype(np.float32), 2 * PX_M, grain, grain_texel_m, 33.0, in_cells(shapes, side_m, side_m)
    )
    y, x = np.mgrid[:512, :512] / 511 * side_m
    tilt = np.radians(rng.uniform(-70, 70))
    across = (x - side_m / 2) * np.cos(tilt) + (y - side_m / 2) * np.sin(tilt)
    light = LightMap(np.where(across > 0, shade, 1.0).astype(np.float32), side_m / 511)
    if leaves:
        ragged = power_law(
            np.random.default_rng([seed, 0x6C656166]), (512, 512), side_m / 511, 1.0, stretch=3.0
        )
        in_shadow = (ragged > np.quantile(ragged, 0.8)).astype(np.float32)
        light = LightMap(1.0 - 0.6 * cv2.GaussianBlur(in_shadow, (0, 0), 1.0), side_m / 511)
    camera = Camera(width_px=SIDE_PX, height_px=SIDE_PX, focal_px=FOCAL_PX)
    pose = CameraPose(position_m=(0.0, -FOCAL_PX * PX_M, 0.0), yaw_deg=0.0, pitch_deg=0.0)
    still = Motion(np.zeros(3), np.zeros(3))
    gathered = expose(camera, pose, still, FaceArrays.of((face,)), lambda _: (skin, light))
    rgb = develop(gathered, camera, automatic_gain(gathered), rng)
    u, v = (np.arange(SIDE_PX) + 0.5) * PX_M, (SIDE_PX - 0.5 - np.arange(SIDE_PX)) * PX_M
    off = (u[None] - side_m / 2) * np.cos(tilt) + (v[:, None] - side_m / 2) * np.sin(tilt)
    truth, wide = (_where(shape, width) for width in (0.0, least_px))
    return Wall(rgb, truth, wide, np.abs(off) < 4 * PX_M, shape)


def _where(shape: CrackShape, least_px: float) -> Mask:
    """(H, W): pixels inside the crack where it is at least so wide, its centreline included."""
    mask = np.zeros((SIDE_PX, SIDE_PX), np.uint8)
    width_px = (shape.left_m + shape.right_m) / PX_M
    xy = np.column_stack([shape.uv_m[:, 0] / PX_M - 0.5, SIDE_PX - 0.5 - shape.uv_m[:, 1] / PX_M])
    for i in np.flatnonzero((width_px[:-1] >= least_px) & (width_px[:-1] > 0)):
        a, b = (tuple(int(n) for n in np.rint(xy[j] * 16)) for j in (i, i + 1))
        cv2.line(mask, a, b, 1, max(1, round(float(width_px[i]))), cv2.LINE_8, 4)
    return mask > 0
