"""Simulated surfaces for training: `python -m training.surfaces FOLDER COUNT [FIRST]`.

Each is rendered through the simulator's camera with cracks of known width, or with none, and with much that
looks like a crack: joints, cables, planks, bricks, pores, tie holes, stains, markers, shadows. The ranges are
wider than any scene of the demo, and the cracks are drawn by code of their own (training.cracks): the demo's
scenes stay unseen.
"""

import sys
from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt

from schemas.camera import Camera, CameraPose
from tasks.simulation.crack import CrackShape
from tasks.simulation.exposure import Motion, expose
from tasks.simulation.face import Face, FaceArrays
from tasks.simulation.grain import power_law
from tasks.simulation.light import LightMap
from tasks.simulation.marks import Shapes, discs, in_cells, line, painted_box, painted_disc, segments
from tasks.simulation.sensor import automatic_gain, develop
from tasks.simulation.skin import Floats, Rgb, Skin, blotch, fine_grain, streak
from training.cracks import DOUBTFUL, VISIBLE, Cracks, cracks_on, one_crack, ragged_joint, seen, told, walk

SIDE_PX = 640
FOCAL_PX = 4000.0
RAGGED = 0.4  # share of joints that are no clean lines
CRACK_FREE = 0.35  # share of surfaces without any crack
TEXEL_PX = 2.0
# Of each kind, its share of the surfaces and the RMS of ln(brightness).
KINDS = {
    "cast": (0.45, 0.06),
    "rough": (0.2, 0.12),
    "smooth": (0.15, 0.025),
    "wood": (0.1, 0.03),
    "brick": (0.1, 0.07),
}

Array = npt.NDArray[np.float64]
Rng = np.random.Generator


def surface(seed: int, crack_free: bool = False) -> tuple[npt.NDArray[np.uint8], npt.NDArray[np.uint8]]:
    """(SIDE_PX, SIDE_PX, 3) uint8 RGB photo of a surface and its (SIDE_PX, SIDE_PX) truth: 255 on cracks,
    DOUBTFUL on what nobody could tell from one."""
    rng = np.random.default_rng([seed, 0x547261696E])
    px_m = float(np.exp(rng.uniform(np.log(0.0003), np.log(0.0015))))
    side_m = 1.04 * SIDE_PX * px_m
    face = Face("board", (-side_m / 2, 0.0, -side_m / 2), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0), side_m, side_m)
    kind = str(rng.choice(list(KINDS), p=[share for share, _ in KINDS.values()]))
    rms = KINDS[kind][1] * float(np.exp(rng.normal(0, 0.25)))
    cracks = () if rng.random() < (1.0 if crack_free else CRACK_FREE) else cracks_on(rng, side_m, px_m, rms)
    wires = _wires(rng, side_m, px_m)
    skin = _skin(rng, seed, kind, rms, face, px_m, cracks, wires)
    camera = Camera(width_px=SIDE_PX, height_px=SIDE_PX, focal_px=FOCAL_PX)
    pose = CameraPose(position_m=(0.0, -FOCAL_PX * px_m, 0.0), yaw_deg=0.0, pitch_deg=0.0)
    speed_m_s = rng.normal(0.0, 0.5, 3) * px_m / camera.shutter_s
    motion = Motion(speed_m_s * (1.0, 0.0, 1.0), np.zeros(3))
    light = LightMap(_light(rng), side_m / 511)
    gathered = expose(camera, pose, motion, FaceArrays.of((face,)), lambda _: (skin, light))
    rgb = develop(gathered, camera, automatic_gain(gathered) * float(np.exp(rng.normal(0.1, 0.3))), rng)
    truth = np.where(seen(wires, SIDE_PX, side_m, px_m) > 0.02, DOUBTFUL, 0)
    truth[seen(cracks, SIDE_PX, side_m, px_m) >= VISIBLE] = 255
    photo = _compressed(rgb, int(rng.integers(70, 96)))
    return photo, told(photo.astype(np.float32) / np.float32(255), truth.astype(np.uint8))


def _compressed(rgb: npt.NDArray[np.uint8], quality: int) -> npt.NDArray[np.uint8]:
    _, jpeg = cv2.imencode(".jpg", np.ascontiguousarray(rgb[..., ::-1]), [cv2.IMWRITE_JPEG_QUALITY, quality])
    return np.ascontiguousarray(np.asarray(cv2.imdecode(jpeg, cv2.IMREAD_COLOR), dtype=np.uint8)[..., ::-1])


# Surfaces


def _skin(
    rng: Rng, seed: int, kind: str, rms: float, face: Face, px_m: float, cracks: Cracks, wires: Cracks
) -> Skin:
    grey = float(np.exp(rng.uniform(np.log(0.12), np.log(0.65))))
    tint = np.exp(rng.normal(0, 0.06, 3)) * np.array([1.05, 1.0, 0.93]) ** rng.uniform(-0.5, 2.5)
    side_m, texel_m = face.width_m, TEXEL_PX * px_m
    shape = (int(side_m / texel_m) + 2, int(side_m / texel_m) + 2)
    scale = px_m / 0.0007  # texture seen at one distance looks like coarser texture seen from further off
    stretch = float(rng.uniform(4, 14)) if kind == "wood" else 1.0
    bright = power_law(rng, shape, texel_m / scale, rms, stretch=stretch)
    if kind == "wood" and rng.random() < 0.5:
        bright = np.ascontiguousarray(bright.T)
    warm = 0.2 * power_law(rng, shape, texel_m / scale, rms, longest_m=0.5)
    tone = np.exp(bright)[..., None] * (grey * tint).astype(np.float32)
    tone[..., 0] *= 1.0 + warm
    tone[..., 2] *= 1.0 - warm
    shapes: list[Shapes] = []
    if kind == "brick":
        shapes += _bricks(rng, tone, side_m, px_m, texel_m)
    elif rng.random() < 0.5:
        shapes += _joints(rng, tone, side_m, px_m, texel_m)
    _stains(rng, tone, texel_m, side_m, px_m)
    tone = np.ascontiguousarray(np.clip(tone, 0.01, 0.95))
    shapes += _pores(rng, side_m, px_m)
    shapes += [crack.shapes for crack in (*cracks, *wires) if len(crack.uv_m) > 1]
    shapes += _cables(rng, side_m, px_m) + _things(rng, side_m, px_m)
    grain, grain_texel_m = fine_grain(seed % 8, rms, stretch)
    turn_deg = 3.0 if kind == "wood" else 33.0
    return Skin(tone, texel_m, grain, grain_texel_m * scale, turn_deg, in_cells(shapes, side_m, side_m))


def _through(rng: Rng, side_m: float, angle_rad: float) -> tuple[Array, Array]:
    """Both ends of a line through the face."""
    middle = rng.uniform(0.1, 0.9, 2) * side_m
    along = 1.5 * side_m * np.array([np.cos(angle_rad), np.sin(angle_rad)])
    return middle - along, middle + along


def _straight(start: Array, end: Array, width_m: float, kept: float, bow_m: float = 0.0) -> Shapes:
    return _bowed(start, end, width_m, kept, bow_m).shapes


def _bowed(start: Array, end: Array, width_m: float, kept: float, bow_m: float) -> CrackShape:
    """A line in short pieces, so that only the cells along it know it; bow_m: sag in the middle."""
    t = np.linspace(0.0, 1.0, 160)
    along = (end - start) / np.linalg.norm(end - start)
    uv = start + t[:, None] * (end - start)
    uv += (bow_m * 4 * t * (1 - t))[:, None] * np.array([-along[1], along[0]])
    half = np.full(len(t), width_m / 2)
    return CrackShape("line", None, uv, half, half, np.full(len(t), kept))


def _joints(rng: Rng, tone: Floats, side_m: float, px_m: float, texel_m: float) -> list[Shapes]:
    """Joints: straight, upright or level or turned. Between boards dark or bright, each board its own tone;
    between two days' pours dark, ragged along both edges, and wet below."""
    shapes = []
    turned = rng.choice([0.0, np.pi / 2, rng.uniform(0, np.pi)], p=[0.4, 0.4, 0.2]) + rng.normal(0, 0.02)
    rows, columns = np.mgrid[: tone.shape[0], : tone.shape[1]] * texel_m
    for k in range(int(rng.integers(1, 5))):
        angle = turned if k == 0 or rng.random() < 0.7 else turned + np.pi / 2
        start, end = _through(rng, side_m, angle)
        width_m = rng.uniform(0.8, 6.0) * px_m
        kept = rng.uniform(0.15, 0.85) if rng.random() < 0.8 else rng.uniform(1.1, 1.4)
        if rng.random() < RAGGED:
            shapes.append(ragged_joint(rng, start, end, width_m, min(kept, 0.8), px_m).shapes)
            if rng.random() < 0.5:
                _drips(rng, tone, start, end, px_m, texel_m)
            continue
        shapes.append(_straight(start, end, width_m, kept))
        if rng.random() < 0.4:  # a lip beside it that catches the light
            off = np.array([-np.sin(angle), np.cos(angle)]) * width_m
            shapes.append(_straight(start + off, end + off, width_m, rng.uniform(1.1, 1.5)))
        side = (columns - start[0]) * -np.sin(angle) + (rows - start[1]) * np.cos(angle) > 0
        tone[side] *= np.float32(np.exp(rng.normal(0.0, 0.06)))
    return shapes


def _drips(rng: Rng, tone: Floats, start: Array, end: Array, px_m: float, texel_m: float) -> None:
    """Dark runs of water, side by side below a joint."""
    reach_m = float(np.exp(rng.uniform(np.log(30), np.log(250)))) * px_m
    dark = rng.uniform(0.1, 0.5)
    for _ in range(int(rng.integers(3, 25))):
        u, v = start + rng.uniform(0.0, 1.0) * (end - start)
        size = (float(rng.uniform(1.0, 5.0)) * px_m, reach_m * float(rng.uniform(0.3, 1.5)))
        factor = float(np.exp(-dark * rng.uniform(0.3, 1.5)))
        streak(tone, texel_m, (float(u), float(v)), size, (factor, factor, factor))


def _bricks(rng: Rng, tone: Floats, side_m: float, px_m: float, texel_m: float) -> list[Shapes]:
    """Courses of bricks or blocks; mortar darker or brighter than they are."""
    high = rng.uniform(40, 160) * px_m
    wide = high * rng.uniform(1.5, 3.5)
    mortar_m = rng.uniform(1.5, 10.0) * px_m
    kept = rng.uniform(0.35, 0.8) if rng.random() < 0.5 else rng.uniform(1.1, 1.6)
    shapes = []
    for row, v in enumerate(np.arange(rng.uniform(-high, 0), side_m, high)):
        shapes.append(_straight(np.array([-0.1, v]), np.array([side_m + 0.1, v]), mortar_m, kept))
        shift = (row % 2) * wide / 2 + rng.uniform(-0.03, 0.03) * wide
        for u in np.arange(shift - wide, side_m, wide):
            shapes.append(line((u, v), (u, v + high), mortar_m, kept))
            r = slice(max(0, int(v / texel_m)), max(0, int((v + high) / texel_m)))
            c = slice(max(0, int(u / texel_m)), max(0, int((u + wide) / texel_m)))
            tone[r, c] *= np.float32(np.exp(rng.normal(0.0, 0.08)))
    return shapes


def _stains(rng: Rng, tone: Floats, texel_m: float, side_m: float, px_m: float) -> None:
    for _ in range(rng.poisson(2.0)):
        place = (rng.uniform(0, side_m), rng.uniform(0, side_m))
        factor: Rgb = tuple(np.exp(rng.normal(-0.2, 0.3) + rng.normal(0, 0.1, 3)))  # type: ignore[assignment]
        if rng.random() < 0.5:
            blotch(tone, texel_m, place, rng.uniform(8, 120) * px_m, factor)
        else:
            streak(tone, texel_m, place, (rng.uniform(4, 30) * px_m, rng.uniform(40, 500) * px_m), factor)
    for _ in range(rng.poisson(0.5)):  # spalls and repairs: patches with a sharp, ragged edge
        centre = rng.uniform(0, side_m, 2) / texel_m
        angle = np.linspace(0, 2 * np.pi, 120, endpoint=False)
        radius = rng.uniform(15, 90) / TEXEL_PX * (1 + 0.25 * walk(rng, 120, 6.0))
        outline = centre + radius[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
        patch = np.zeros(tone.shape[:2], np.uint8)
        cv2.fillPoly(patch, [np.rint(outline).astype(np.int32)], 1)
        tone[patch > 0] *= np.float32(np.exp(rng.normal(-0.15, 0.35)))


def _pores(rng: Rng, side_m: float, px_m: float) -> list[Shapes]:
    n = rng.poisson(float(np.exp(rng.uniform(np.log(3), np.log(250)))))
    uv = rng.uniform(0, side_m, (n, 2))
    radius = np.minimum(rng.uniform(0.5, 1.5) * (1 - rng.uniform(0, 1, n)) ** (-1 / 2.5), 9.0) * px_m
    shapes = [discs(uv, radius, rng.uniform(0.25, 0.8, n))]
    if rng.random() < 0.3:  # tie holes with their plugs
        uv = rng.uniform(0.1, 0.9, (int(rng.integers(1, 5)), 2)) * side_m
        rim = np.full(len(uv), rng.uniform(7, 22) * px_m)
        shapes += [discs(uv, rim, np.full(len(uv), rng.uniform(0.15, 0.6)))]
        shapes += [discs(uv, 0.82 * rim, np.full(len(uv), rng.uniform(0.8, 3.0)))]
    return shapes


def _wires(rng: Rng, side_m: float, px_m: float) -> Cracks:
    """Wires and cables so thin that their roundness does not show: dark, smooth, as wide everywhere."""
    wires = []
    for _ in range(rng.poisson(0.15)):
        start, end = _through(rng, side_m, rng.uniform(0, np.pi))
        bow_m, wide_m = rng.normal(0, 0.04) * side_m, rng.uniform(1.0, 4.0) * px_m
        wires.append(_bowed(start, end, wide_m, float(rng.uniform(0.1, 0.6)), bow_m))
    return tuple(wires)


def _cables(rng: Rng, side_m: float, px_m: float) -> list[Shapes]:
    """Round ones: they shine along one side and may throw a shadow beside them."""
    shapes = []
    for _ in range(rng.poisson(0.25)):
        start, end = _through(rng, side_m, rng.uniform(0, np.pi))
        bow, wide = rng.normal(0, 0.04) * side_m, rng.uniform(4.0, 14.0) * px_m
        across = np.array([-(end - start)[1], (end - start)[0]]) / np.linalg.norm(end - start) * wide
        shapes.append(_straight(start, end, wide, float(rng.uniform(0.08, 0.5)), bow))
        shine = rng.uniform(-0.35, 0.35) * across
        shapes.append(_straight(start + shine, end + shine, 0.3 * wide, float(rng.uniform(1.2, 4.0)), bow))
        if rng.random() < 0.4:
            off = rng.uniform(1.2, 4.0) * across
            shapes.append(_straight(start + off, end + off, wide, float(rng.uniform(0.5, 0.8)), bow))
    return shapes


def _things(rng: Rng, side_m: float, px_m: float) -> list[Shapes]:
    """What lies on top: chalk, markers, scratches."""
    shapes: list[Shapes] = []
    for _ in range(rng.poisson(0.5)):  # chalk and scratches: bright, and wandering like a crack
        mark = one_crack(rng, rng.uniform(0, side_m, 2), rng.uniform(0, 2 * np.pi), side_m, px_m, 0.0)
        if len(mark.uv_m) > 1:
            bright = np.full(len(mark.uv_m), rng.uniform(1.15, 2.0))
            shapes.append(segments(mark.uv_m, mark.left_m, mark.right_m, bright))
    for _ in range(rng.poisson(0.3)):
        hue = rng.uniform(0.05, 0.9, 3)
        colour: Rgb = (float(hue[0]), float(hue[1]), float(hue[2]))
        place = rng.uniform(0.05, 0.95, 2) * side_m
        if rng.random() < 0.5:
            size = (float(rng.uniform(15, 120) * px_m), float(rng.uniform(4, 40) * px_m))
            shapes.append(painted_box(place, float(rng.uniform(0, 180)), size, colour))
        else:
            shapes.append(painted_disc(place, float(rng.uniform(6, 40) * px_m), colour))
    return shapes


def _light(rng: Rng) -> Floats:
    """(512, 512) irradiance over the face: even, falling off, or with the edge of a shadow across it."""
    y, x = np.mgrid[:512, :512].astype(np.float32) / 511 - 0.5
    angle = rng.uniform(0, 2 * np.pi)
    along = x * np.float32(np.cos(angle)) + y * np.float32(np.sin(angle))
    light = np.exp(rng.normal(0, 0.25) * along)
    if rng.random() < 0.35:
        for _ in range(int(rng.integers(1, 3))):
            angle = rng.uniform(0, 2 * np.pi)
            across = x * np.float32(np.cos(angle)) + y * np.float32(np.sin(angle)) - rng.uniform(-0.35, 0.35)
            if rng.random() < 0.3:  # a bar: pole, cable, railing
                across = np.abs(across) - rng.uniform(0.005, 0.1)
            soft = np.exp(rng.uniform(np.log(0.0008), np.log(0.03)))
            light *= 1.0 - rng.uniform(0.2, 0.7) / (1.0 + np.exp(np.clip(across / soft, -40, 40)))
    return np.ascontiguousarray(light, dtype=np.float32)


def main(folder: Path, count: int, first: int = 0) -> None:
    for part in ("images", "masks"):
        (folder / part).mkdir(parents=True, exist_ok=True)
    for seed in range(first, first + count):
        rgb, truth = surface(seed)
        cv2.imwrite(str(folder / "masks" / f"{seed:05d}.png"), truth)
        cv2.imwrite(str(folder / "images" / f"{seed:05d}.png"), np.ascontiguousarray(rgb[..., ::-1]))


if __name__ == "__main__":
    main(Path(sys.argv[1]), *(int(n) for n in sys.argv[2:]))
