"""The rendered concrete against what grain.py says of real concrete (10th to 90th percentile)."""

import cv2
import numpy as np

from schemas.camera import CameraPose
from tasks.simulation.bridge import WEB, bridge
from tasks.simulation.concrete import PORES_PER_M2, joint_positions_m
from tasks.simulation.marks import DISC
from tasks.simulation.photography import render

SIDE_PX = 160


def patch_statistics(light: np.ndarray) -> tuple[float, float, float, float]:
    """Slope of the 2D spectrum, RMS, RMS after the high pass, excess kurtosis, of ln(light)."""
    y, x = np.mgrid[:SIDE_PX, :SIDE_PX]
    plane = np.column_stack([x.ravel(), y.ravel(), np.ones(SIDE_PX**2)])
    flat = np.log(light + 0.01)
    flat = flat - (plane @ np.linalg.lstsq(plane, flat.ravel(), rcond=None)[0]).reshape(flat.shape)
    window = np.hanning(SIDE_PX)
    power = np.abs(np.fft.fft2(flat * window * window[:, None])) ** 2
    f = np.hypot(*np.meshgrid(np.fft.fftfreq(SIDE_PX), np.fft.fftfreq(SIDE_PX)))
    bands = 0.015 * 2.0 ** np.arange(4)
    mean = [power[(f >= a) & (f < 2 * a)].mean() for a in bands]
    fine = flat - cv2.GaussianBlur(flat, (0, 0), 6)
    kurtosis = ((fine - fine.mean()) ** 4).mean() / fine.var() ** 2 - 3
    return np.polyfit(np.log(bands), np.log(mean), 1)[0], flat.std(), fine.std(), kurtosis


def test_photos_have_the_statistics_of_real_concrete() -> None:
    scene = bridge(1)
    face = scene.face(WEB)
    camera = scene.camera.model_copy(update={"width_px": 640, "height_px": 480})
    ahead = -face.normal
    pose = CameraPose(
        position_m=tuple(face.to_world([(4.4, 0.3)])[0] - 4.0 * ahead),
        yaw_deg=float(np.degrees(np.arctan2(ahead[0], ahead[1]))),
        pitch_deg=0.0,
    )
    srgb = render(scene, camera, pose, (0.0, 0.0, 0.0), [1]) / 255.0
    light = np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4).mean(axis=2)
    patches = [light[y : y + SIDE_PX, x : x + SIDE_PX] for y in (0, 160, 320) for x in (0, 160, 320, 480)]
    slope, rms, fine, kurtosis = np.median([patch_statistics(p) for p in patches], axis=0)
    assert -2.73 < slope < -1.70
    assert 0.10 < rms < 0.41
    assert 0.065 < fine < 0.23
    assert -0.2 < kurtosis < 10.0


def test_pores_joints_and_cracks_are_marks_of_the_skin() -> None:
    scene = bridge(1)
    index = [f.name for f in scene.faces].index(WEB)
    skin, _ = scene.look(index)
    face = scene.face(WEB)
    pores = int((skin.marks.kind == DISC).sum())
    expected = PORES_PER_M2 * face.width_m * face.height_m
    assert abs(pores - expected) < 6 * np.sqrt(expected) + 20
    assert len(joint_positions_m(face)) == 4
    assert int((skin.marks.kind != DISC).sum()) > sum(len(c.uv_m) - 1 for c in scene.cracks[WEB])
