"""A flat grey board before a camera, with marks of known size on it."""

from collections.abc import Sequence

import numpy as np

from schemas.camera import Camera, CameraPose
from tasks.simulation.exposure import Floats, Motion, expose
from tasks.simulation.face import Array, Face, FaceArrays
from tasks.simulation.light import LightMap
from tasks.simulation.marks import Shapes, in_cells
from tasks.simulation.skin import Skin

CAMERA = Camera(width_px=240, height_px=180, focal_px=1000.0, k1=-0.06, k2=0.03, p1=1e-3, p2=-5e-4)
BOARD = Face("board", (-0.5, 0.0, -0.4), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0), 1.0, 0.8)  # faces south
GREY = 0.5
STILL = Motion(np.zeros(3), np.zeros(3))
AHEAD = CameraPose(position_m=(0.0, -1.0, 0.0), yaw_deg=0.0, pitch_deg=0.0)  # 1 mm a pixel


def board_skin(shapes: Sequence[Shapes], face: Face = BOARD) -> Skin:
    tone = np.full((12, 12, 3), GREY, np.float32)
    grain = np.zeros((2048, 2048), np.int8)
    return Skin(tone, 0.1, grain, 0.001, 0.0, in_cells(shapes, face.width_m, face.height_m))


def photo_of(
    shapes: Sequence[Shapes], pose: CameraPose = AHEAD, motion: Motion = STILL, camera: Camera = CAMERA
) -> Floats:
    """Linear light of the board under even light: GREY where nothing is on it."""
    skin = board_skin(shapes)
    light = LightMap(np.ones((4, 4), np.float32), 0.5)
    return expose(camera, pose, motion, FaceArrays.of((BOARD,)), lambda _: (skin, light))


def on_board(points_m: Array) -> Array:
    """(N, 3) world points as (N, 2) board coordinates."""
    return BOARD.to_face(points_m)[:, :2]
