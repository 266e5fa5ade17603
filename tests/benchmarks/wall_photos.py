"""Photo sets of a simulated wall for the stitching benchmark, each with the fault it is named after, and the
truth of every photo: which points of the wall its pixels show.

Photos come from the simulator's lens, sensor and JPEG (tasks/simulation), which the stitching knows nothing
of. One millimetre a pixel at any size: lens errors, relief and shutter then weigh the same in pixels."""

import json
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np
import numpy.typing as npt
from PIL import Image
from scipy.ndimage import gaussian_filter, map_coordinates

from schemas.camera import Camera, CameraPose
from schemas.contract import Vector3
from schemas.geodesy import GeoOrigin
from tasks.simulation.concrete import concrete
from tasks.simulation.crack import CrackShape, crack
from tasks.simulation.exposure import Motion, expose
from tasks.simulation.face import Face
from tasks.simulation.grain import power_law
from tasks.simulation.light import Daylight
from tasks.simulation.marks import in_cells
from tasks.simulation.photography import Exposure, encode
from tasks.simulation.scene import Scene
from tasks.simulation.sensor import automatic_gain, develop
from tasks.simulation.skin import Skin
from tasks.stitching.gain import srgb_to_linear

Array = npt.NDArray[np.float64]

GSD_M = 0.001
ASPECT = 0.75
FOCAL = 1.2  # of the width
OVERLAP = (0.6, 0.5)
MARGIN_M = 0.5  # of wall around what the photos show
GPS_ORIGIN = GeoOrigin(latitude_deg=48.0, longitude_deg=11.0, altitude_m=500.0)


@dataclass(frozen=True)
class Case:
    name: str
    what: str
    k1: float = 0.0  # that nobody knows of
    centre: float = 0.0  # of the focal length: how far the lens lies off the sensor's middle, either way
    readout_s: float = 0.0
    speed_m_s: float = 0.0
    speed_sigma_m_s: float | None = None  # how well the flight log tells the speed along each axis, if at all
    relief_m: float = 0.0  # from the lowest to the highest point
    scanned: bool = False  # the relief is known from a laser scan
    surface: str = "concrete"  # "faint", "tiles"
    position_sigma_m: float = 0.1
    gain: float = 0.15  # exposures differ by this, either way
    lost: int = 0
    intruders: bool = False  # photos of another wall, one mirrored, one cut short
    cracks_a_m2: float = 0.0


CASES = (
    Case("plane", "plane, global shutter"),
    Case("k1", "k1 = −0.05 unknown", k1=-0.05),
    Case("centre", "k1 = −0.05 and a lens off its middle, unknown", k1=-0.05, centre=0.004),
    Case(
        "rolling",
        "rolling shutter 30 ms at 0.1 m/s, logged to 3 cm/s",
        readout_s=0.03,
        speed_m_s=0.1,
        speed_sigma_m_s=0.03,
    ),
    Case("rolling-blind", "rolling shutter 30 ms at 0.1 m/s, no log", readout_s=0.03, speed_m_s=0.1),
    Case("relief", "3 cm of relief, no scan", relief_m=0.03),
    Case("relief-scan", "3 cm of relief, scanned", relief_m=0.03, scanned=True),
    Case("cracks", "cracked wall", cracks_a_m2=0.6),
    Case("tiles", "repeated texture", surface="tiles"),
    Case("faint", "low contrast", surface="faint"),
    Case("lost", "shuffled names, photos lost, positions off by 1.5 m", position_sigma_m=1.5, lost=4),
    Case("intruders", "photos of another wall, a mirrored one, one cut short", intruders=True),
)


@dataclass(frozen=True)
class Shown:
    """What a photo shows: (N, 2) its pixels and (N, 2) the metres (u, v) of the wall that they show."""

    px: Array
    uv_m: Array
    exposed: float  # factor on linear light, as the file has it
    see: Callable[[Array], Array]  # (N, 2) metres of the wall at any (N, 2) of its pixels


@dataclass(frozen=True)
class WallPhotos:
    folder: Path  # of the JPEGs
    camera: Camera  # as the crew knows it
    face: Face
    poses: dict[str, CameraPose]  # as reported, by file name
    position_sigma_m: float
    velocities_m_s: dict[str, Vector3 | None]  # as logged, by file name
    truth: dict[str, Shown]  # of the photos that belong to the wall
    scan_m: Array | None  # (N, 3) world points, as a registered model has them
    cracks: tuple[CrackShape, ...]
    intruders: tuple[str, ...]


def wall_photos(case: Case, columns: int, rows: int, megapixels: float, seed: int, cache: Path) -> WallPhotos:
    """Rendered into `cache` at the first call for these arguments."""
    folder = cache / f"{case.name}-{columns}x{rows}-{megapixels:g}MP-{seed}"
    width = int(round(np.sqrt(megapixels * 1e6 / ASPECT) / 16) * 16)
    nominal = Camera(width_px=width, height_px=int(width * ASPECT), focal_px=FOCAL * width, k1=-0.02)
    said = folder / "set.json"
    face = _face(nominal, columns, rows)
    rng = np.random.default_rng([seed, *case.name.split("-")[0].encode()])  # as named before the dash
    scene = _scene(case, face, nominal, seed)
    true_camera = _true_camera(case, scene.true_camera)
    shots = _shots(case, true_camera, face, columns, rows, rng)
    lost = set(rng.choice(len(shots), case.lost, replace=False).tolist())
    shots = [shot for k, shot in enumerate(shots) if k not in lost]
    names = [f"DJI_{k:04d}.jpg" for k in rng.permutation(len(shots))]
    bias = rng.normal(0.0, case.position_sigma_m * 0.7, 3)
    exposed = np.exp(rng.uniform(np.log(1 - case.gain), np.log(1 + case.gain), len(shots)))
    relief = _relief(case, face, seed)
    log = np.random.default_rng([seed, 17])
    poses, velocities, truth = {}, dict[str, Vector3 | None](), {}
    for name, shot, gain in zip(names, shots, exposed, strict=True):
        off = bias + rng.normal(0.0, case.position_sigma_m * 0.7, 3)
        position = np.asarray(shot.pose.position_m) + off
        poses[name] = CameraPose(
            position_m=(position[0], position[1], position[2]), yaw_deg=0.0, pitch_deg=0.0
        )
        velocities[name] = None
        if case.speed_sigma_m_s is not None:
            x, y, z = shot.motion.velocity_m_s + log.normal(0.0, case.speed_sigma_m_s, 3)
            velocities[name] = (float(x), float(y), float(z))
        px, see = _grid(true_camera), partial(_seen, true_camera, shot, face, relief)
        truth[name] = Shown(px, see(px), float(gain), see)
    kept: dict[str, float] = {}  # of the light, by file name: faint texture loses or wins .5 % in a JPEG
    if not said.is_file():
        folder.mkdir(parents=True, exist_ok=True)
        usual = automatic_gain(expose(true_camera, shots[0].pose, shots[0].motion, scene.arrays, scene.look))
        for k, (name, shot) in enumerate(zip(names, shots, strict=True)):
            light = expose(true_camera, shot.pose, shot.motion, scene.arrays, scene.look)
            pixels = develop(
                light, true_camera, usual * truth[name].exposed, np.random.default_rng([seed, k])
            )
            (folder / name).write_bytes(_jpeg(pixels, nominal, face, name, poses[name]))
            kept[name] = _light_of(folder / name) / _mean_light(pixels)
        if case.intruders:
            _intrude(folder, case, true_camera, nominal, face, shots, names, poses, seed)
        files = sorted(p.name for p in folder.glob("*.jpg"))
        said.write_text(json.dumps({name: kept.get(name) for name in files}))
    kept = json.loads(said.read_text())
    truth = {name: replace(one, exposed=one.exposed * kept[name]) for name, one in truth.items()}
    intruders = tuple(name for name in kept if name not in truth)
    for name in intruders:
        poses[name] = poses[names[INTRUDED[name]]]
        velocities[name] = velocities[names[INTRUDED[name]]]
    scan = _scanned(relief, face, seed) if case.scanned else None
    return WallPhotos(
        folder,
        nominal,
        face,
        poses,
        case.position_sigma_m,
        velocities,
        truth,
        scan,
        _cracks(case, face, seed),
        intruders,
    )


INTRUDED = {"other-1.jpg": 1, "other-2.jpg": 2, "other-3.jpg": 3, "mirrored.jpg": 4, "cut.jpg": 5}


def _true_camera(case: Case, camera: Camera) -> Camera:
    """With what nobody knows of it."""
    x, y = camera.principal_px
    off = case.centre * camera.focal_px
    values = {"k1": camera.k1 + case.k1, "cx_px": x + off, "cy_px": y - 0.6 * off}
    return Camera.model_validate(camera.model_dump() | values)


@dataclass(frozen=True)
class _Shot:
    pose: CameraPose
    motion: Motion


def _face(camera: Camera, columns: int, rows: int) -> Face:
    """A wall that faces south, as large as what is photographed and a margin."""
    width, height = camera.width_px * GSD_M, camera.height_px * GSD_M
    size = (
        width * (1 + (columns - 1) * (1 - OVERLAP[0])) + 2 * MARGIN_M,
        height * (1 + (rows - 1) * (1 - OVERLAP[1])) + 2 * MARGIN_M,
    )
    return Face("wall", (0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0), *size)


def _shots(
    case: Case, camera: Camera, face: Face, columns: int, rows: int, rng: np.random.Generator
) -> list[_Shot]:
    width, height = camera.width_px * GSD_M, camera.height_px * GSD_M
    stand_off = GSD_M * camera.focal_px
    shots = []
    for row in range(rows):
        for column in range(columns):
            at = np.array(
                [
                    MARGIN_M + width * (0.5 + column * (1 - OVERLAP[0])),
                    -stand_off,
                    MARGIN_M + height * (0.5 + row * (1 - OVERLAP[1])),
                ]
            )
            x, y, z = at + rng.normal(0.0, 0.02 * width, 3)
            yaw, pitch, roll = rng.normal(0.0, 1.5, 3)
            along = rng.uniform(0, 2 * np.pi)
            velocity = case.speed_m_s * np.array([np.cos(along), 0.2 * rng.standard_normal(), np.sin(along)])
            turn = np.radians(rng.normal(0.0, 0.4, 3))
            pose = CameraPose(position_m=(x, y, z), yaw_deg=yaw, pitch_deg=pitch, roll_deg=roll)
            shots.append(_Shot(pose, Motion(velocity, turn, case.readout_s)))
    return shots


def _scene(case: Case, face: Face, camera: Camera, seed: int) -> Scene:
    return Scene(
        name=case.name,
        seed=seed,
        faces=(face,),
        inspected=("wall",),
        cracks={},
        markers=(),
        bake=_baker(case, seed),
        daylight=Daylight.of(azimuth_deg=200.0, elevation_deg=40.0, sun=1.0, sky=0.6),
        camera=camera,
        gsd_mm_px=GSD_M * 1000,
    )


def _baker(case: Case, seed: int) -> Callable[[Face], Skin]:
    def bake(face: Face) -> Skin:
        skin, size = concrete(face, _cracks(case, face, seed), seed), (face.width_m, face.height_m)
        if case.surface == "faint":
            mean = skin.tone.mean(axis=(0, 1))
            tone = mean + np.float32(0.25) * (skin.tone - mean)
            skin = replace(
                skin, tone=tone, grain=(skin.grain // 4).astype(np.int8), marks=in_cells([], *size)
            )
        elif case.surface == "tiles":
            side = round(0.3 / skin.texel_m)
            one = skin.tone[:side, :side]
            rows, columns = (-(-n // side) for n in skin.tone.shape[:2])
            same = np.tile(one, (rows, columns, 1))[: skin.tone.shape[0], : skin.tone.shape[1]]
            tone = np.float32(0.85) * same + np.float32(0.15) * skin.tone
            tone[::side], tone[:, ::side] = 0.1, 0.1
            skin = replace(
                skin, tone=tone, grain=(skin.grain // 4).astype(np.int8), marks=in_cells([], *size)
            )
        return replace(skin, relief_m=_relief(case, face, seed), relief_texel_m=RELIEF_TEXEL_M)

    return bake


RELIEF_TEXEL_M = 0.02


def _cracks(case: Case, face: Face, seed: int) -> tuple[CrackShape, ...]:
    """Here and there, any way, 1 to 5 mm wide and half a metre to two long."""
    rng = np.random.default_rng([seed, 13])
    cracks = []
    for k in range(round(case.cracks_a_m2 * face.width_m * face.height_m)):
        start = (float(rng.uniform(0.1, 0.9) * face.width_m), float(rng.uniform(0.1, 0.9) * face.height_m))
        heading, length, width = rng.uniform(0, 360), rng.uniform(0.5, 2.0), rng.uniform(0.001, 0.005)
        one = crack(rng, f"C{k}", start, heading, length, width)
        inside = ((one.uv_m > 0) & (one.uv_m < [face.width_m, face.height_m])).all(axis=1)
        end = len(inside) if inside.all() else int(np.argmin(inside))
        if end > 20:
            parts = (one.uv_m[:end], one.left_m[:end], one.right_m[:end], one.kept_light[:end])
            cracks.append(CrackShape(one.id, None, *parts))
    return tuple(cracks)


def _relief(case: Case, face: Face, seed: int) -> npt.NDArray[np.float32]:
    """Gentle waves, a decimetre to a metre long."""
    if case.relief_m == 0.0:
        return np.zeros((0, 0), np.float32)
    shape = (int(face.height_m / RELIEF_TEXEL_M) + 2, int(face.width_m / RELIEF_TEXEL_M) + 2)
    rough = power_law(np.random.default_rng([seed, 7]), shape, RELIEF_TEXEL_M, 0.1, longest_m=1.0)
    smooth = gaussian_filter(rough, 0.1 / RELIEF_TEXEL_M)
    return np.asarray(
        (smooth - smooth.min()) / np.ptp(smooth) * case.relief_m - case.relief_m / 2, np.float32
    )


def _scanned(relief: npt.NDArray[np.float32], face: Face, seed: int) -> Array:
    """Points 2 cm apart, as registration merges them, 3 mm off in range."""
    rng = np.random.default_rng([seed, 11])
    u, v = np.meshgrid(np.arange(0, face.width_m, 0.02), np.arange(0, face.height_m, 0.02))
    uv = np.column_stack([u.ravel(), v.ravel()]) + rng.uniform(-0.01, 0.01, (u.size, 2))
    height = map_coordinates(relief, (uv / RELIEF_TEXEL_M).T[::-1], order=1, mode="nearest")
    off = height + rng.normal(0.0, 0.003, len(uv))
    return np.asarray(face.to_world(uv) + off[:, None] * face.normal)


def _grid(camera: Camera) -> Array:
    x, y = np.meshgrid(np.linspace(0, camera.width_px - 1, 9), np.linspace(0, camera.height_px - 1, 7))
    return np.column_stack([x.ravel(), y.ravel()])


def _seen(camera: Camera, shot: _Shot, face: Face, relief: npt.NDArray[np.float32], px: Array) -> Array:
    """(N, 2) metres on the wall of (N, 2) pixels: pose and turn of the row's instant, then the relief."""
    when = (px[:, 1] / camera.height_px - 0.5) * shot.motion.readout_s
    ideal = camera.undistort((px - camera.principal_px) / camera.focal_px)
    rays = np.column_stack([ideal, np.ones(len(ideal))])
    rays = rays + when[:, None] * np.cross(shot.motion.turn_rad_s, rays)
    rays = rays @ shot.pose.R_world_camera.T @ face.R_world_face
    at = face.to_face(np.asarray(shot.pose.position_m) + when[:, None] * shot.motion.velocity_m_s)
    flat = at[:, :2] - rays[:, :2] * (at[:, 2] / rays[:, 2])[:, None]
    if relief.size == 0:
        return np.asarray(flat)
    uv = flat.copy()
    for _ in range(20):
        height = map_coordinates(relief, (uv / RELIEF_TEXEL_M).T[::-1], order=1, mode="nearest")
        uv = flat + (height / at[:, 2])[:, None] * (at[:, :2] - flat)
    return np.asarray(uv)


def _jpeg(pixels: npt.NDArray[np.uint8], camera: Camera, face: Face, name: str, pose: CameraPose) -> bytes:
    """With a GPS position as if the wall lay on the ground: that is what other tools understand."""
    u, v, w = face.to_face(pose.position_m)[0]
    lying = CameraPose(position_m=(float(u), float(v), float(w)), yaw_deg=0.0, pitch_deg=-90.0)
    return encode(pixels, camera, Exposure(name, lying, measured=lying), GPS_ORIGIN)


def _light_of(jpeg: Path) -> float:
    with Image.open(jpeg) as image:
        return _mean_light(np.asarray(image))


def _mean_light(pixels: npt.NDArray[np.uint8]) -> float:
    """Linear, of green."""
    return float(srgb_to_linear()[pixels[..., 1]].mean(dtype=np.float64))


def _intrude(
    folder: Path,
    case: Case,
    true_camera: Camera,
    nominal: Camera,
    face: Face,
    shots: list[_Shot],
    names: list[str],
    poses: dict[str, CameraPose],
    seed: int,
) -> None:
    other = _scene(case, face, nominal, seed + 1000)
    usual = automatic_gain(expose(true_camera, shots[0].pose, shots[0].motion, other.arrays, other.look))
    for name, k in INTRUDED.items():
        if name.startswith("other"):
            light = expose(true_camera, shots[k].pose, shots[k].motion, other.arrays, other.look)
            pixels = develop(light, true_camera, usual, np.random.default_rng([seed, 900 + k]))
            (folder / name).write_bytes(_jpeg(pixels, nominal, face, name, poses[names[k]]))
        elif name == "cut.jpg":
            whole = (folder / names[k]).read_bytes()
            (folder / name).write_bytes(whole[: len(whole) // 2])
        else:
            with Image.open(folder / names[k]) as image:
                mirrored = np.ascontiguousarray(np.asarray(image)[:, ::-1])
            (folder / name).write_bytes(_jpeg(mirrored, nominal, face, name, poses[names[k]]))
