"""The paper's artificial wall (section 4): nine wooden panels of 900 × 600 mm with seams and twisted ties,
eighteen pink patterns, two cracks (middle, bottom right), partly in the sun and partly in shade."""

import numpy as np

from schemas.camera import Camera, CameraPose
from schemas.simulation import Marker
from tasks.simulation.concrete import plain
from tasks.simulation.crack import CrackShape, crack
from tasks.simulation.face import Face, Placement, vector
from tasks.simulation.light import Daylight
from tasks.simulation.marks import Shapes, line, painted_box, painted_disc, segments
from tasks.simulation.scene import Scene
from tasks.simulation.skin import Skin
from tasks.simulation.wood import wood

PLACE = Placement(yaw_deg=-8.0)
CAMERA = Camera(width_px=1632, height_px=1224, focal_px=4000.0, k1=-0.06, k2=0.03)
GSD_MM_PX = 0.55
PANEL_M = (0.9, 0.6)
SEAM_M = 0.003
LOW_M = 0.5  # of the wall above ground
WALL = "wall"
PINK = (0.88, 0.30, 0.52)
BACKGROUND_M = 2.5  # a façade behind the wall
PHOTOS = (5, 5)  # columns, rows
POSITION_SIGMA_M, ANGLE_SIGMA_DEG = 0.05, 1.0
SIZE_M = (3 * PANEL_M[0], 3 * PANEL_M[1])


def wall(seed: int) -> Scene:
    rng = np.random.default_rng([seed, 0x57616C6C])
    panels = tuple(
        (PANEL_M[0] * c + SEAM_M / 2, PANEL_M[1] * r + SEAM_M / 2, PANEL_M[0] - SEAM_M, PANEL_M[1] - SEAM_M)
        for r in range(3)
        for c in range(3)
    )
    cracks = _cracks(rng)
    patterns, markers = _patterns(rng, cracks)
    marks = (*_seams(), *_ties(rng), *patterns)
    faces = _faces()

    def bake(face: Face) -> Skin:
        if face.name == WALL:
            return wood(face, panels, cracks, marks, seed)
        return plain(face, seed, (0.15, 0.17, 0.10) if face.name == "ground" else (0.10, 0.10, 0.11))

    return Scene(
        name="wall",
        seed=seed,
        faces=faces,
        inspected=(WALL,),
        cracks={WALL: cracks},
        markers=markers,
        bake=bake,
        daylight=Daylight.of(azimuth_deg=215.0, elevation_deg=35.0, sun=1.0, sky=0.62),
        camera=CAMERA,
        gsd_mm_px=GSD_MM_PX,
        gain=1.16,  # exposed for the sunlit part, by hand
    )


def wall_poses(seed: int) -> tuple[tuple[str, CameraPose, CameraPose], ...]:
    """Name, true pose and measured pose of each photo: a grid in front of the wall, held by hand."""
    rng = np.random.default_rng([seed, 0x506F7365])
    face = next(f for f in _faces() if f.name == WALL)
    distance_m = CAMERA.stand_off_m(GSD_MM_PX)
    footprint = np.asarray(CAMERA.footprint_m(distance_m))
    facing = -face.normal
    yaw = float(np.degrees(np.arctan2(facing[0], facing[1])))
    poses = []
    for row in range(PHOTOS[1]):
        for column in range(PHOTOS[0]):
            share = np.array([column / (PHOTOS[0] - 1), 1.0 - row / (PHOTOS[1] - 1)])
            uv = footprint / 2 - 0.05 + share * (np.asarray(SIZE_M) - footprint + 0.1)
            aim = face.to_world([uv])[0] + distance_m * face.normal
            true = _off(CameraPose(position_m=vector(aim), yaw_deg=yaw, pitch_deg=0.0), rng, 0.03, 1.0)
            measured = _off(true, rng, POSITION_SIGMA_M, ANGLE_SIGMA_DEG)
            poses.append((f"{WALL}-{row * PHOTOS[0] + column + 1:02d}", true, measured))
    return tuple(poses)


def _off(pose: CameraPose, rng: np.random.Generator, sigma_m: float, sigma_deg: float) -> CameraPose:
    x, y, z = np.asarray(pose.position_m) + rng.normal(0.0, sigma_m, 3)
    yaw, pitch, roll = rng.normal(0.0, sigma_deg, 3)
    return CameraPose(
        position_m=(float(x), float(y), float(z)),
        yaw_deg=pose.yaw_deg + float(yaw),
        pitch_deg=pose.pitch_deg + float(pitch),
        roll_deg=pose.roll_deg + float(roll),
    )


def _faces() -> tuple[Face, ...]:
    """The wall looks south; something east of it throws a hard shadow on its right part."""
    x, y, z = np.eye(3)
    low = -SIZE_M[0] / 2
    return (
        PLACE.face(WALL, (low, 0.0, LOW_M), x, z, SIZE_M[0], SIZE_M[1], "wood"),
        PLACE.face("ground", (-15.0, -15.0, 0.0), x, y, 30.0, 15.0 + BACKGROUND_M, "ground"),
        PLACE.face("facade", (-8.0, BACKGROUND_M, 0.0), x, z, 16.0, 6.0),
        PLACE.face("sunshade", (-2.35, -1.2, 1.6), x, (0.3, -0.1, 0.9486832980505138), 1.1, 2.4),
    )


def _cracks(rng: np.random.Generator) -> tuple[CrackShape, ...]:
    middle = (1.13 + rng.uniform(-0.04, 0.04), 0.74 + rng.uniform(-0.02, 0.02))
    corner = (2.02 + rng.uniform(-0.04, 0.04), 0.42 + rng.uniform(-0.03, 0.03))
    return (
        crack(rng, "middle", middle, rng.uniform(28, 40), rng.uniform(0.46, 0.54), 0.0055, darkness=0.71),
        crack(
            rng, "bottom-right", corner, rng.uniform(-32, -20), rng.uniform(0.44, 0.52), 0.0034, darkness=0.8
        ),
    )


def _seams() -> list[Shapes]:
    across = [line((0.0, PANEL_M[1] * r), (SIZE_M[0], PANEL_M[1] * r), SEAM_M, 0.12) for r in (1, 2)]
    upright = [line((PANEL_M[0] * c, 0.0), (PANEL_M[0] * c, SIZE_M[1]), SEAM_M, 0.12) for c in (1, 2)]
    return across + upright


def _ties(rng: np.random.Generator) -> list[Shapes]:
    """Twisted wires that hold neighbouring panels together across their seams."""
    ties = []
    places = [(PANEL_M[0] * c, PANEL_M[1] * (r + s)) for c in (1, 2) for r in range(3) for s in (0.2, 0.8)]
    for u, v in places:
        t = np.linspace(-1.0, 1.0, 41)
        slope = rng.uniform(-0.3, 0.3)
        twist = 0.0015 * np.sin(9.0 * t + rng.uniform(0, 6))
        points = np.column_stack([u + 0.03 * t, v + 0.03 * slope * t + twist])
        half = np.full(len(t), 0.0009)
        ties.append(segments(points, half, half, np.full(len(t), 0.2)))
    return ties


def _patterns(
    rng: np.random.Generator, cracks: tuple[CrackShape, ...]
) -> tuple[list[Shapes], tuple[Marker, ...]]:
    """Two patterns a panel, none alike, none on a crack or a seam."""
    shapes: list[Shapes] = []
    markers: list[Marker] = []
    taken = np.vstack([c.uv_m for c in cracks])
    for row in range(3):
        for column in range(3):
            placed = 0
            while placed < 2:
                share = rng.uniform((0.12, 0.17), (0.88, 0.83))
                centre = (np.array([column, row]) + share) * PANEL_M
                if np.linalg.norm(taken - centre, axis=1).min() < 0.12:
                    continue
                taken = np.vstack([taken, centre])
                shapes += _pattern(rng, centre)
                # the surface's own frame starts in its middle, the face's in its corner
                uv = centre - np.asarray(SIZE_M) / 2
                markers.append(Marker(surface=WALL, centre_uv_m=(float(uv[0]), float(uv[1])), radius_m=0.06))
                placed += 1
    return shapes, tuple(markers)


def _pattern(rng: np.random.Generator, centre: np.ndarray) -> list[Shapes]:
    parts = [painted_box(centre, rng.uniform(0, 90), (rng.uniform(0.03, 0.06), 0.022), PINK)]
    for _ in range(rng.integers(1, 4)):
        shift = rng.uniform(-0.03, 0.03, 2)
        if rng.random() < 0.5:
            parts.append(painted_disc(centre + shift, rng.uniform(0.008, 0.018), PINK))
        else:
            size = (rng.uniform(0.015, 0.045), rng.uniform(0.01, 0.02))
            parts.append(painted_box(centre + shift, rng.uniform(0, 180), size, PINK))
    return parts
