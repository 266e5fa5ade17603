"""A building's front on a street: windows in their reveals, a projecting middle, a balcony, a cornice.

Its own frame: x along the street, y into the building, z up, the street at 0; the front's main wall at y = 0.
"""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from schemas.geodesy import GeoOrigin
from tasks.simulation.bridge import ASPHALT, CAMERA, COLOURS, GSD_MM_PX
from tasks.simulation.concrete import plain
from tasks.simulation.face import Face, Placement
from tasks.simulation.light import Daylight
from tasks.simulation.plants import crown
from tasks.simulation.scene import Scene
from tasks.simulation.skin import Skin

PLACE = Placement(yaw_deg=7.0, offset_m=(1.3, 2.1, 0.0))
ORIGIN = GeoOrigin(latitude_deg=-33.8688, longitude_deg=151.2073, altitude_m=15.0)

Opening = tuple[float, float, float, float]  # x0, z0, x1, z1 on the front
HALF_M, TOP_M, DEEP_M = 10.0, 11.4, 8.0
PLINTH_M, PLINTH_OUT_M = 0.8, 0.1
CORNICE_M, CORNICE_OUT_M = 0.6, 0.4
MIDDLE_M, MIDDLE_OUT_M = 2.2, 0.5  # half width of the projecting middle
REVEAL_M = 0.2
WINDOW_M = (1.3, 1.7)
WINDOW_X_M, WINDOW_Z_M = (-8.3, -5.9, -3.5, 0.0, 3.5, 5.9, 8.3), (1.6, 5.0, 8.4)  # middles; sills
DOOR: Opening = (-0.8, PLINTH_M, 0.8, 3.2)
BALCONY_Z_M = 4.6
CABLE_M = 0.02
STATIONS_M = (
    (-7.0, -8.5, 1.6),
    (7.5, -9.0, 1.7),
    (0.5, -13.0, 1.6),
    (-13.0, -5.0, 1.7),
    (13.5, -3.5, 1.6),
    (2.5, -6.0, 1.7),
    (-3.0, -11.0, 1.6),
    (16.0, 3.0, 1.7),
    (-16.5, 2.0, 1.6),
)


def facade(seed: int) -> Scene:
    faces = (*_building(), *_street(np.random.default_rng([seed, 0x46616361])))

    def bake(face: Face) -> Skin:
        colour = (
            ASPHALT if face.name == "ground" else COLOURS.get(face.name.split("-")[0], (0.55, 0.50, 0.42))
        )
        return plain(face, seed, (0.03, 0.03, 0.04) if face.material == "glass" else colour, 0.06)

    return Scene(
        name="facade",
        seed=seed,
        faces=faces,
        inspected=(),
        cracks={},
        markers=(),
        bake=bake,
        daylight=Daylight.of(azimuth_deg=195.0, elevation_deg=40.0, sun=0.35, sky=1.0),
        camera=CAMERA,
        gsd_mm_px=GSD_MM_PX,
        stations_m=tuple(PLACE.point(p) for p in STATIONS_M),
        origin=ORIGIN,
    )


def pierced(name: str, outer: Opening, y_m: float, openings: Sequence[Opening]) -> tuple[Face, ...]:
    """A wall that faces the street (south), as rectangles around its openings."""
    x, _, z = np.eye(3)
    x0, z0, x1, z1 = outer
    levels = sorted({z0, z1, *(o[1] for o in openings), *(o[3] for o in openings)})
    faces: list[Face] = []
    for low, high in pairwise(levels):
        cut = sorted(o for o in openings if o[1] <= low and o[3] >= high)
        starts, ends = (x0, *(o[2] for o in cut)), (*(o[0] for o in cut), x1)
        for a, b in zip(starts, ends, strict=True):
            faces.append(PLACE.face(f"{name}-{len(faces)}", (a, y_m, low), x, z, b - a, high - low))
    return tuple(faces)


def _windows(y_m: float, openings: Sequence[Opening], name: str) -> tuple[Face, ...]:
    """The reveals, and the pane behind them."""
    x, y, z = np.eye(3)
    faces: list[Face] = []
    for number, (x0, z0, x1, z1) in enumerate(openings):
        part, wide, high = f"{name}{number}", x1 - x0, z1 - z0
        faces += [
            PLACE.face(f"{part}-pane", (x0, y_m + REVEAL_M, z0), x, z, wide, high, "glass"),
            PLACE.face(f"{part}-sill", (x0, y_m, z0), x, y, wide, REVEAL_M),
            PLACE.face(f"{part}-lintel", (x0, y_m + REVEAL_M, z1), x, -y, wide, REVEAL_M),
            PLACE.face(f"{part}-left", (x0, y_m, z0), y, z, REVEAL_M, high),
            PLACE.face(f"{part}-right", (x1, y_m + REVEAL_M, z0), -y, z, REVEAL_M, high),
        ]
    return tuple(faces)


def _building() -> tuple[Face, ...]:
    wide, high = WINDOW_M
    faces: list[Face] = []
    main: list[Opening] = []
    middle: list[Opening] = []
    for x in WINDOW_X_M:
        for z in WINDOW_Z_M:
            (middle if abs(x) < MIDDLE_M else main).append((x - wide / 2, z, x + wide / 2, z + high))
    middle[0] = DOOR
    for side, (x0, x1) in (("west", (-HALF_M, -MIDDLE_M)), ("east", (MIDDLE_M, HALF_M))):
        own = [o for o in main if x0 < o[0] < x1]
        faces += pierced(f"front-{side}", (x0, PLINTH_M, x1, TOP_M), 0.0, own)
        faces += _windows(0.0, own, f"window-{side}")
        faces += PLACE.box(f"plinth-{side}", (x0, -PLINTH_OUT_M, 0.0), (x1, 0.0, PLINTH_M), "west")
    out = -MIDDLE_OUT_M
    faces += pierced("middle", (-MIDDLE_M, PLINTH_M, MIDDLE_M, TOP_M), out, middle)
    faces += _windows(out, middle, "window-middle")
    faces += PLACE.box("middle-side", (-MIDDLE_M, out, PLINTH_M), (MIDDLE_M, 0.0, TOP_M), "we")
    faces += PLACE.box(
        "plinth-middle", (-MIDDLE_M, out - PLINTH_OUT_M, 0.0), (MIDDLE_M, 0.0, PLINTH_M), "west"
    )
    cornice = (-HALF_M - CORNICE_OUT_M, out - CORNICE_OUT_M, TOP_M)
    faces += PLACE.box("cornice", cornice, (HALF_M + CORNICE_OUT_M, DEEP_M, TOP_M + CORNICE_M), "wesntb")
    faces += PLACE.box("side", (-HALF_M, 0.0, 0.0), (HALF_M, DEEP_M, TOP_M), "we")
    balcony = (-1.9, out - 1.2, BALCONY_Z_M - 0.15)
    faces += PLACE.box("balcony", balcony, (1.9, out, BALCONY_Z_M), "westb")
    for k, x in enumerate(np.linspace(-1.86, 1.84, 12)):
        low = (float(x), out - 1.18, BALCONY_Z_M)
        faces += PLACE.box(
            f"rail-{k}", low, (low[0] + 0.02, low[1] + 0.02, BALCONY_Z_M + 1.0), "wesn", "metal"
        )
    faces += PLACE.box(
        "rail-top",
        (-1.9, out - 1.19, BALCONY_Z_M + 1.0),
        (1.9, out - 1.14, BALCONY_Z_M + 1.04),
        "wesntb",
        "metal",
    )
    return tuple(faces)


def _street(rng: np.random.Generator) -> tuple[Face, ...]:
    x, y, _ = np.eye(3)
    faces = [PLACE.face("ground", (-30.0, -30.0, 0.0), x, y, 60.0, 60.0, "ground")]
    for number, at in enumerate((-9.5, 3.5)):
        faces += PLACE.box(f"car{number}-body", (at, -4.9, 0.25), (at + 4.2, -3.2, 0.9), material="metal")
        faces += PLACE.box(
            f"car{number}-cabin", (at + 0.9, -4.8, 0.9), (at + 3.3, -3.3, 1.45), material="metal"
        )
    for number, at in enumerate((-11.0, 10.5)):
        faces += PLACE.box(f"lamp{number}-post", (at, -2.6, 0.0), (at + 0.1, -2.5, 6.0), "wesnt", "metal")
    faces += PLACE.box("bin", (-4.2, -2.2, 0.0), (-3.8, -1.8, 0.9), material="metal")
    faces += PLACE.box("bench", (5.0, -1.9, 0.0), (6.5, -1.45, 0.45))
    wire = (-14.0, -6.5, 7.0)
    faces += PLACE.box("cable", wire, (14.0, wire[1] + CABLE_M, wire[2] + CABLE_M), "wesntb", "metal")
    faces += PLACE.box("trunk", (-13.6, -9.1, 0.0), (-13.4, -8.9, 3.0), "wesn", "leaf")
    faces += crown(PLACE, rng, (-13.5, -9.0, 4.2))
    faces += crown(PLACE, rng, (11.5, -7.0, 0.9), radius_m=0.9, leaves=160)
    return tuple(faces)
