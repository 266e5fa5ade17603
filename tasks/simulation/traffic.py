"""What does not stand still between two scans: people, cars, leaves in the wind."""

from dataclasses import replace

import numpy as np

from schemas.contract import Vector3
from tasks.simulation.face import Array, Face, Placement, vector
from tasks.simulation.raycast import cast
from tasks.simulation.scene import Scene

NEAREST_M, FARTHEST_M = 2.5, 16.0  # of a scanner
ROOM_M = 0.15  # between what moves and what stands
SUNK_M = 0.1  # into uneven ground
TRIES = 200
PERSON_M, CAR_M = (0.45, 0.28, 1.72), (4.2, 1.7, 1.45)
Boxes = tuple[tuple[str, Vector3, Vector3], ...]
PERSON: Boxes = (
    ("body", (-0.22, -0.14, -SUNK_M), (0.22, 0.14, 1.45)),
    ("head", (-0.1, -0.1, 1.45), (0.1, 0.1, 1.72)),
)
CAR: Boxes = (
    ("body", (-2.1, -0.85, 0.2), (2.1, 0.85, 0.9)),
    ("cabin", (-1.2, -0.75, 0.9), (1.2, 0.75, 1.45)),
)


def met_faces(
    scene: Scene, people: int, cars: int, sway_m: float, rng: np.random.Generator
) -> tuple[Face, ...]:
    """The scene's faces as one station meets them, then those of whoever is about."""
    standing = swaying(scene.faces, sway_m, rng) if sway_m else scene.faces
    lows = np.array([f.corners_m.min(axis=0) for f in scene.faces if f.material != "ground"])
    highs = np.array([f.corners_m.max(axis=0) for f in scene.faces if f.material != "ground"])
    about: list[Face] = []
    for number in range(cars + people):
        name, boxes, size = ("car", CAR, CAR_M) if number < cars else ("person", PERSON, PERSON_M)
        place = _free_place(scene, lows, highs, float(np.hypot(*size[:2])) / 2, size[2], rng)
        if place is None:
            continue
        for part, low, high in boxes:
            about += place.box(f"{name}{number}-{part}", low, high, "wesntb", "metal")
        corners = np.concatenate([f.corners_m for f in about[-12:]])
        lows, highs = np.vstack([lows, corners.min(axis=0)]), np.vstack([highs, corners.max(axis=0)])
    return (*standing, *about)


def swaying(faces: tuple[Face, ...], sway_m: float, rng: np.random.Generator) -> tuple[Face, ...]:
    """Leaves elsewhere: the gust moves all of them, each flutters by half as much again."""
    gust = rng.normal(0.0, sway_m, 3) * (1.0, 1.0, 0.3)
    return tuple(
        replace(f, origin_m=vector(f.origin_m + gust + rng.normal(0.0, sway_m / 2, 3)))
        if f.name.startswith("leaf")
        else f
        for f in faces
    )


def _free_place(
    scene: Scene, lows: Array, highs: Array, radius_m: float, height_m: float, rng: np.random.Generator
) -> Placement | None:
    """On the ground in sight of a station, clear of all that stands and of every scanner."""
    stations = np.asarray(scene.stations_m)
    for _ in range(TRIES):
        station = stations[rng.integers(len(stations))]
        turn, away = rng.uniform(0, 2 * np.pi), rng.uniform(NEAREST_M, FARTHEST_M)
        above = station + away * np.array([np.cos(turn), np.sin(turn), 0.0])
        index, depth_m = cast(above, [[0.0, 0.0, -1.0]], scene.arrays)
        if index[0] < 0 or scene.faces[index[0]].material != "ground":
            continue
        foot = above - [0.0, 0.0, depth_m[0]]
        reach = np.array([radius_m, radius_m, 0.0]) + ROOM_M
        blocked = (lows < foot + reach + [0, 0, height_m]) & (highs > foot - reach)
        if blocked.all(axis=1).any():
            continue
        if np.linalg.norm((stations - foot)[:, :2], axis=1).min() < radius_m + 1.0:
            continue
        return Placement(yaw_deg=float(rng.uniform(0, 360)), offset_m=vector(foot))
    return None
