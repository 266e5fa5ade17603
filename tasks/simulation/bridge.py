"""The bridge: one span of four girders on two piers, ground, and a few things that stand around.

Its own frame: x along the bridge, z up, the ground at 0; it stands turned and shifted in the world.
"""

from itertools import pairwise

import numpy as np

from schemas.camera import Camera
from schemas.geodesy import GeoOrigin
from tasks.simulation.concrete import concrete, plain
from tasks.simulation.crack import CrackShape, branch, crack
from tasks.simulation.face import Face, Placement
from tasks.simulation.light import Daylight
from tasks.simulation.plants import crown
from tasks.simulation.scene import Scene
from tasks.simulation.skin import Skin

PLACE = Placement(yaw_deg=1.5, offset_m=(0.6, -0.4, 0.0))
ORIGIN = GeoOrigin(latitude_deg=-33.8830, longitude_deg=151.2005, altitude_m=20.0)
CAMERA = Camera(width_px=1632, height_px=1224, focal_px=4000.0, k1=-0.06, k2=0.03)
GSD_MM_PX = 1.0

GIRDER_LOW_M, SOFFIT_M, DECK_TOP_M = 5.6, 6.55, 6.8
HALF_SPAN_M = 6.1  # to the girders' ends
GIRDERS_M = (-2.4, -0.8, 0.8, 2.4)  # y of their middles
HALF_GIRDER_M = 0.2
HALF_DECK_M = 3.0
BAY_M = 5.4  # the soffit bays end at cross-beams
WEB, SOFFIT, PIER = "web-south", "soffit-south", "pier-west"
INSPECTED = (WEB, SOFFIT, PIER)
GRASS, ASPHALT, METAL, BARK, LEAVES = (
    (0.13, 0.17, 0.07),
    (0.11, 0.11, 0.11),
    (0.30, 0.31, 0.32),
    (0.14, 0.10, 0.07),
    (0.07, 0.14, 0.04),
)
COLOURS = {
    "ground": GRASS,
    "lamp": METAL,
    "rail": METAL,
    "car": (0.45, 0.05, 0.04),
    "trunk": BARK,
    "leaf": LEAVES,
}
STATIONS_M = (  # of the scanner's head, in the bridge's frame
    (-3.5, -9.0, 1.6),
    (5.5, -8.0, 1.7),
    (3.5, 8.5, 1.6),
    (-6.0, 8.5, 1.7),
    (-2.6, 0.3, 1.6),
    (2.8, -0.9, 1.6),
)


def bridge(seed: int) -> Scene:
    faces = (*_structure(), *_surroundings(np.random.default_rng([seed, 0x54726565])))
    cracks = _cracks(seed, {f.name: f for f in faces})

    def bake(face: Face) -> Skin:
        if face.name in INSPECTED:
            return concrete(face, cracks[face.name], seed)
        colour = COLOURS.get(face.name.split("-")[0], (0.40, 0.39, 0.37))
        return plain(face, seed, colour, 0.12 if face.material in ("ground", "leaf") else 0.04)

    return Scene(
        name="bridge",
        seed=seed,
        faces=faces,
        inspected=INSPECTED,
        cracks=cracks,
        markers=(),
        bake=bake,
        daylight=Daylight.of(azimuth_deg=205.0, elevation_deg=48.0, sun=0.35, sky=1.0),  # hazy
        camera=CAMERA,
        gsd_mm_px=GSD_MM_PX,
        stations_m=tuple(PLACE.point(p) for p in STATIONS_M),
        origin=ORIGIN,
    )


def _structure() -> tuple[Face, ...]:
    x, y, _ = np.eye(3)
    faces: list[Face] = []
    for number, middle in enumerate(GIRDERS_M):
        low = (-HALF_SPAN_M, middle - HALF_GIRDER_M, GIRDER_LOW_M)
        high = (HALF_SPAN_M, middle + HALF_GIRDER_M, SOFFIT_M)
        faces += PLACE.box(f"girder{number}", low, high, "wesnb")
    faces = [_renamed(f, WEB) if f.name == "girder0-south" else f for f in faces]
    for number, (left, right) in enumerate(pairwise(GIRDERS_M)):
        y0, y1 = left + HALF_GIRDER_M, right - HALF_GIRDER_M
        name = SOFFIT if number == 0 else f"soffit{number}"
        faces.append(PLACE.face(name, (BAY_M, y0, SOFFIT_M), -x, y, 2 * BAY_M, y1 - y0))
        for side, at in (("west", -BAY_M), ("east", BAY_M)):
            away = np.sign(at) * 0.3
            low = (min(at, at + away), y0, GIRDER_LOW_M + 0.1)
            faces += PLACE.box(f"beam{number}-{side}", low, (max(at, at + away), y1, SOFFIT_M), "web")
    deck = (HALF_SPAN_M + 0.1, HALF_DECK_M)
    faces += PLACE.box("deck", (-deck[0], -deck[1], SOFFIT_M), (deck[0], deck[1], DECK_TOP_M), "wesnt")
    for y0, y1 in (
        (-HALF_DECK_M, GIRDERS_M[0] - HALF_GIRDER_M),
        (GIRDERS_M[-1] + HALF_GIRDER_M, HALF_DECK_M),
    ):
        faces.append(PLACE.face(f"overhang-{y0:.0f}", (deck[0], y0, SOFFIT_M), -x, y, 2 * deck[0], y1 - y0))
    for name, y0 in (("kerb-south", -HALF_DECK_M), ("kerb-north", HALF_DECK_M - 0.25)):
        faces += PLACE.box(name, (-deck[0], y0, DECK_TOP_M), (deck[0], y0 + 0.25, DECK_TOP_M + 0.3), "wesnt")
    for k in range(7):
        for y0 in (-HALF_DECK_M + 0.1, HALF_DECK_M - 0.15):
            low = (-6.0 + 2.0 * k, y0, DECK_TOP_M + 0.3)
            faces += PLACE.box(f"rail-{k}{y0:.0f}", low, (low[0] + 0.05, y0 + 0.05, 8.0), "wesnt", "metal")
    for side, at in (("west", -6.0), ("east", 6.0)):
        cap = ((at - 0.6, -2.8, 4.9), (at + 0.6, 2.8, GIRDER_LOW_M))
        faces += PLACE.box(f"cap-{side}", *cap, "wesntb")
        faces += PLACE.box(f"column-{side}", (at - 0.4, -0.8, 0.0), (at + 0.4, 0.8, 4.9), "wesn")
    return tuple(_renamed(f, PIER) if f.name == "column-west-east" else f for f in faces)


def _renamed(face: Face, name: str) -> Face:
    return Face(name, face.origin_m, face.u, face.v, face.width_m, face.height_m, face.material)


def _surroundings(rng: np.random.Generator) -> tuple[Face, ...]:
    x, y, _ = np.eye(3)
    faces = [PLACE.face("ground", (-35.0, -35.0, 0.0), x, y, 70.0, 70.0, "ground")]
    faces += PLACE.box("lamp-post", (5.0, -10.0, 0.0), (5.07, -9.93, 6.5), "wesnt", "metal")
    faces += PLACE.box("lamp-arm", (5.0, -10.9, 6.5), (5.07, -9.93, 6.57), "wesntb", "metal")
    faces += PLACE.box("car-body", (1.0, 6.6, 0.25), (5.2, 8.3, 0.9), "wesntb", "metal")
    faces += PLACE.box("car-cabin", (1.9, 6.7, 0.9), (4.3, 8.2, 1.45), "wesnt", "metal")
    faces += PLACE.box("trunk", (-7.55, -11.05, 0.0), (-7.39, -10.89, 3.0), "wesn", "leaf")
    faces += crown(PLACE, rng, (-7.5, -11.0, 4.2))
    return tuple(faces)


def _cracks(seed: int, faces: dict[str, Face]) -> dict[str, tuple[CrackShape, ...]]:
    """Four on the web, three on the soffit, three on the pier, and branches of the two widest. Widths are
    drawn around 5, 4, 2 and 1 mm, that is pixels at the demo's scale."""
    rng = np.random.default_rng([seed, 0x437261])

    def about(value: float, share: float = 0.1) -> float:
        return float(value * rng.uniform(1 - share, 1 + share))

    def spot(u: float, v: float) -> tuple[float, float]:
        return u + float(rng.uniform(-0.15, 0.15)), v + float(rng.uniform(-0.03, 0.03))

    web, soffit, pier = (faces[name] for name in INSPECTED)
    m = web.width_m / 2  # flexure in the middle of the span, shear near its ends
    flexure = crack(rng, "W1", spot(m, 0.06), about(90, 0.05), about(0.72), about(4.6 / 1e3))
    w = (
        flexure,
        branch(rng, flexure, 0.45, about(0.22), 0.55),
        crack(rng, "W2", spot(2.2, 0.12), about(38, 0.1), about(0.85), about(4.0 / 1e3)),
        crack(rng, "W3", spot(m + 2.9, 0.1), about(97, 0.05), about(0.55), about(2.1 / 1e3)),
        crack(rng, "W4", spot(m - 2.6, 0.15), about(85, 0.05), about(0.45), about(1.1 / 1e3)),
    )
    s = (
        crack(rng, "S1", spot(soffit.width_m * 0.30, 0.12), about(88, 0.05), about(0.9), about(4.4 / 1e3)),
        crack(rng, "S2", spot(soffit.width_m * 0.48, 0.6), rng.uniform(-6, 6), about(1.7), about(3.9 / 1e3)),
        crack(rng, "S3", spot(soffit.width_m * 0.80, 0.2), about(80, 0.1), about(0.6), about(2.0 / 1e3)),
    )
    u = pier.width_m
    split = crack(rng, "P1", spot(u * 0.55, 1.5), about(91, 0.04), about(1.6), about(5.0 / 1e3))
    p = (
        split,
        branch(rng, split, 0.5, about(0.35), 0.5),
        crack(rng, "P2", (0.2, 3.75), rng.uniform(-8, 8), about(1.0), about(3.9 / 1e3)),
        crack(rng, "P3", (0.25, 1.5 + rng.uniform(0, 0.3)), about(75, 0.1), about(0.6), about(1.6 / 1e3)),
    )
    return {WEB: w, SOFFIT: s, PIER: p}
