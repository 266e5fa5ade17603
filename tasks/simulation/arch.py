"""A masonry arch bridge: one segmental barrel between spandrel walls, a walkway on round piers beside it.

Its own frame: x along the bridge, z up, the ground at 0. Curved parts are made of flat facets that leave the
true curve by a millimetre at most.
"""

from itertools import pairwise

import numpy as np

from schemas.geodesy import GeoOrigin
from tasks.simulation.bridge import CAMERA, COLOURS, GSD_MM_PX
from tasks.simulation.concrete import plain
from tasks.simulation.face import Face, Placement
from tasks.simulation.light import Daylight
from tasks.simulation.plants import crown
from tasks.simulation.scene import Scene
from tasks.simulation.skin import Skin

PLACE = Placement(yaw_deg=-4.0, offset_m=(-1.1, 0.7, 0.0))
ORIGIN = GeoOrigin(latitude_deg=-33.8702, longitude_deg=151.2093, altitude_m=8.0)

HALF_SPAN_M, SPRING_M, RISE_M = 6.0, 1.2, 4.0
RADIUS_M = (HALF_SPAN_M**2 + RISE_M**2) / (2 * RISE_M)
CENTRE_M = SPRING_M + RISE_M - RADIUS_M  # z of the barrel's axis
FACETS = 96
HALF_WIDTH_M = 2.5
HALF_LENGTH_M = 9.0
DECK_M, COURSE_M, PARAPET_M = 6.2, 5.95, 7.2  # z of the road, of the string course's underside, of the top
COURSE_OUT_M = 0.12
PIERS_M, PIER_RADIUS_M, PIER_FACETS = (-6.5, 0.0, 6.5), 0.45, 48
WALKWAY_Y_M, WALKWAY_Z_M = (4.5, 6.0), (3.2, 3.4)
CABLE_M = 0.02
STATIONS_M = (
    (-4.0, -9.5, 1.6),
    (5.0, -9.0, 1.7),
    (-1.5, -1.0, 1.6),
    (2.0, 1.2, 1.6),
    (4.0, 9.5, 1.7),
    (-5.0, 10.0, 1.6),
    (-13.0, -2.5, 1.7),
    (13.0, 2.5, 1.6),
    (0.5, 14.0, 1.7),
)


def arch(seed: int) -> Scene:
    faces = (*_structure(), *_walkway(), *_surroundings(np.random.default_rng([seed, 0x41726368])))

    def bake(face: Face) -> Skin:
        return plain(face, seed, COLOURS.get(face.name.split("-")[0], (0.42, 0.38, 0.33)), 0.06)

    return Scene(
        name="arch",
        seed=seed,
        faces=faces,
        inspected=(),
        cracks={},
        markers=(),
        bake=bake,
        daylight=Daylight.of(azimuth_deg=205.0, elevation_deg=48.0, sun=0.35, sky=1.0),
        camera=CAMERA,
        gsd_mm_px=GSD_MM_PX,
        stations_m=tuple(PLACE.point(p) for p in STATIONS_M),
        curved=("barrel", *(f"pier{k}" for k in range(len(PIERS_M)))),
        origin=ORIGIN,
    )


def round_pier(
    place: Placement, name: str, x_m: float, y_m: float, radius_m: float, height_m: float, facets: int
) -> tuple[Face, ...]:
    """An upright cylinder from the ground, in the structure's own frame."""
    turn = 2 * np.pi * np.arange(facets + 1) / facets
    ring = np.column_stack([x_m + radius_m * np.cos(turn), y_m + radius_m * np.sin(turn)])
    faces = []
    for k, (a, b) in enumerate(pairwise(ring)):
        width = float(np.linalg.norm(b - a))
        along = (*((b - a) / width), 0.0)
        faces.append(place.face(f"{name}-{k:02d}", (*a, 0.0), along, (0.0, 0.0, 1.0), width, height_m))
    return tuple(faces)


def _structure() -> tuple[Face, ...]:
    x, y, z = np.eye(3)
    half = np.arcsin(HALF_SPAN_M / RADIUS_M)
    turn = np.linspace(-half, half, FACETS + 1)
    curve = np.column_stack([RADIUS_M * np.sin(turn), CENTRE_M + RADIUS_M * np.cos(turn)])  # x, z
    faces: list[Face] = []
    width, out = 2 * HALF_WIDTH_M, COURSE_OUT_M
    for k, (a, b) in enumerate(pairwise(curve)):
        chord = float(np.linalg.norm(b - a))
        along = np.array([(b - a)[0], 0.0, (b - a)[1]]) / chord
        corner = (a[0], -HALF_WIDTH_M, a[1])
        faces.append(PLACE.face(f"barrel-{k:02d}", corner, y, along, width, chord))
        low = float((a[1] + b[1]) / 2)  # the saw teeth left at the arch's edge are millimetres
        faces += PLACE.box(f"spandrel{k}", (a[0], -HALF_WIDTH_M, low), (b[0], HALF_WIDTH_M, COURSE_M), "sn")
    near, far = (-HALF_LENGTH_M, -HALF_WIDTH_M, 0.0), (-HALF_SPAN_M, HALF_WIDTH_M, DECK_M)
    faces += PLACE.box("abutment-west", near, far, "snw")
    faces += PLACE.box("abutment-east", (HALF_SPAN_M, -HALF_WIDTH_M, 0.0), (HALF_LENGTH_M, *far[1:]), "sne")
    faces += [
        PLACE.face("springing-west", (-HALF_SPAN_M, -HALF_WIDTH_M, 0.0), y, z, width, SPRING_M),
        PLACE.face("springing-east", (HALF_SPAN_M, HALF_WIDTH_M, 0.0), -y, z, width, SPRING_M),
    ]
    for side, (y0, y1) in (
        ("south", (-HALF_WIDTH_M, -HALF_WIDTH_M + 0.3)),
        ("north", (HALF_WIDTH_M - 0.3, HALF_WIDTH_M)),
    ):
        course = (y0 - out, y1) if side == "south" else (y0, y1 + out)
        faces += PLACE.box(
            f"course-{side}",
            (-HALF_LENGTH_M, course[0], COURSE_M),
            (HALF_LENGTH_M, course[1], DECK_M),
            "wesntb",
        )
        faces += PLACE.box(
            f"parapet-{side}", (-HALF_LENGTH_M, y0, DECK_M), (HALF_LENGTH_M, y1, PARAPET_M), "wesnt"
        )
    faces.append(PLACE.face("road", (-HALF_LENGTH_M, -HALF_WIDTH_M, DECK_M), x, y, 2 * HALF_LENGTH_M, width))
    return tuple(faces)


def _walkway() -> tuple[Face, ...]:
    (y0, y1), (z0, z1) = WALKWAY_Y_M, WALKWAY_Z_M
    faces = [*PLACE.box("walkway", (-8.0, y0, z0), (8.0, y1, z1), "wesntb")]
    for k, x in enumerate(PIERS_M):
        faces += round_pier(PLACE, f"pier{k}", x, (y0 + y1) / 2, PIER_RADIUS_M, z0, PIER_FACETS)
    for number, x in enumerate((-7.9, 7.9)):
        faces += PLACE.box(
            f"rail-post{number}", (x - 0.03, y1 - 0.08, z1), (x + 0.03, y1 - 0.02, z1 + 1.1), "wesnt", "metal"
        )
    cable = (-7.9, y1 - 0.06, z1 + 1.05)
    faces += PLACE.box("rail-cable", cable, (7.9, cable[1] + CABLE_M, cable[2] + CABLE_M), "wesntb", "metal")
    return tuple(faces)


def _surroundings(rng: np.random.Generator) -> tuple[Face, ...]:
    x, y, _ = np.eye(3)
    faces = [PLACE.face("ground", (-32.0, -32.0, 0.0), x, y, 64.0, 64.0, "ground")]
    faces += PLACE.box("bench", (8.0, -7.0, 0.0), (9.5, -6.55, 0.45))
    faces += PLACE.box("bollard", (-8.0, -6.0, 0.0), (-7.7, -5.7, 0.8), material="metal")
    faces += PLACE.box("sign-post", (6.0, -5.2, 0.0), (6.06, -5.14, 2.4), "wesnt", "metal")
    faces += PLACE.box("sign-plate", (5.75, -5.22, 1.8), (6.31, -5.2, 2.4), material="metal")
    faces += PLACE.box("trunk", (-10.1, 8.9, 0.0), (-9.9, 9.1, 3.0), "wesn", "leaf")
    faces += crown(PLACE, rng, (-10.0, 9.0, 4.2))
    faces += crown(PLACE, rng, (11.0, -6.0, 0.9), radius_m=0.9, leaves=160)
    return tuple(faces)
