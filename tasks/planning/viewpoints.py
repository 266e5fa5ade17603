"""Shooting points (paper, section 2.3): where to stand so that every part of a surface is seen at the asked
ground sample distance, from the camera's intrinsics, the surface's area and the expected position error."""

import math
from collections import Counter
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import shapely

from schemas.camera import Camera, CameraPose
from schemas.problem import BadInput
from schemas.settings import PlanSettings
from schemas.surface import Surface
from schemas.vehicle import Vehicle
from tasks.planning.airspace import Airspace
from tasks.planning.allowed import Block
from tasks.planning.sight import Scene, outline_of

Array = npt.NDArray[np.float64]
Flags = npt.NDArray[np.bool_]

MOST_PHOTOS = 20_000  # of one surface
MOST_WIDENED = 0.8  # overlap is not widened beyond this: photos grow with 1 / (1 − overlap)²
RING_DEG = 5.0  # step of the oblique views that are tried
VERTICAL_DEG = 5.0  # a view this close to straight up or down is flown as straight up or down

UNSEEN = "in or beside air that no scanner saw and plan.free_m does not state"
OUTSIDE = "outside the fence or too near to it"
NO_FLY = "in a no-fly box or too near to it"


@dataclass(frozen=True)
class View:
    """A shooting point of a surface. row, column: its place in the grid; target: where its axis meets."""

    surface: str
    row: int
    column: int
    target_m: Array  # (3,) world
    pose: CameraPose
    incidence_deg: float = 0.0  # 0 where it looks perpendicularly


@dataclass(frozen=True)
class Views:
    """The shooting points found for a surface at one stand-off, and why others were not."""

    stand_off_m: float
    views: tuple[View, ...]
    refused: Counter[str]  # reason -> number of shooting points
    wanted_m: Array  # (N, 3) where a photo would be taken from if nothing forbade it

    @property
    def reached(self) -> float:
        return len(self.views) / max(len(self.views) + self.refused.total(), 1)

    @property
    def squareness(self) -> float:
        """1 where all shooting points look perpendicularly, less for obliques (cos²), 0 for those refused."""
        cos = np.cos(np.radians([v.incidence_deg for v in self.views]))
        return float((cos**2).sum()) / max(len(self.views) + self.refused.total(), 1)


def widened_overlap(overlap: float, footprint_m: tuple[float, float], jitter_m: float) -> float:
    """The overlap to plan so that `overlap` is left when two neighbouring photos stray apart by the jitter
    (2σ of the difference of two). The slow bias moves neighbours together and costs no overlap."""
    stray = 2.0 * math.sqrt(2.0) * jitter_m / min(footprint_m)
    return max(overlap, min(overlap + stray, MOST_WIDENED))


def shooting_grid(
    surface: Surface, footprint_m: tuple[float, float], overlap: float, margin_m: float
) -> tuple[npt.NDArray[np.int64], Array]:
    """Rows and columns (N, 2) and targets (N, 2) in (u, v) metres of the photos that cover the outline.

    The photographed rectangle reaches `margin_m` beyond the outline on every side; photos whose footprint
    does not meet the outline are left out (where the margin is wider than a footprint: not even nearly).
    """
    turn = grid_turn(surface)
    outline = shapely.transform(outline_of(surface), lambda uv: uv @ turn)
    u_low, v_low, u_high, v_high = outline.bounds
    u = _line(u_low - margin_m, u_high + margin_m, footprint_m[0], overlap)
    v = _line(v_low - margin_m, v_high + margin_m, footprint_m[1], overlap)
    if len(u) * len(v) > MOST_PHOTOS:
        raise BadInput(
            surface.name,
            f"photographing it would take about {len(u) * len(v):,} photos",
            "Ask for a coarser plan.gsd_mm_px or less overlap, or name fewer surfaces in plan.surfaces.",
        )
    row, column = (a.ravel() for a in np.meshgrid(np.arange(len(v)), np.arange(len(u)), indexing="ij"))
    targets = np.column_stack([u[column], v[row]])
    half = np.asarray(footprint_m) / 2
    photos = shapely.box(*(targets - half).T, *(targets + half).T)
    wanted = outline.buffer(max(margin_m - min(footprint_m), 0.0) + 1e-6, join_style="mitre")
    meets = shapely.intersects(photos, wanted)
    return np.column_stack([row, column])[meets], targets[meets] @ turn.T


def grid_turn(surface: Surface) -> Array:
    """(2, 2) columns: the grid's axes in (u, v). They are u and v, but on a horizontal surface, where the
    camera may turn, they lie along the outline's narrowest rectangle, at most 45° from u and v."""
    if abs(surface.plane.normal[2]) < np.cos(np.radians(VERTICAL_DEG)):
        return np.eye(2)
    corners = np.array(outline_of(surface).minimum_rotated_rectangle.exterior.coords)
    side = corners[1] - corners[0]
    angle = (np.arctan2(side[1], side[0]) + np.pi / 4) % (np.pi / 2) - np.pi / 4
    return np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])


def _line(low: float, high: float, footprint: float, overlap: float) -> Array:
    """Evenly spread middles of photos that cover low..high with at least `overlap`."""
    steps = int(np.ceil(max(high - low - footprint, 0.0) / (footprint * (1 - overlap)) - 1e-9))
    if steps == 0:
        return np.array([(low + high) / 2])
    return np.linspace(low + footprint / 2, high - footprint / 2, steps + 1)


def camera_towards(forward: Array, right: Array) -> tuple[Array, Array, Array]:
    """Yaw and pitch (N,) in degrees, roll being zero, of view directions (N, 3), and the directions as flown.

    Straight up and down, and within 5° of it, the yaw is free: the image's right is laid along `right`.
    """
    flat = np.hypot(forward[:, 0], forward[:, 1])
    vertical = flat < np.sin(np.radians(VERTICAL_DEG))
    yaw = np.where(vertical, np.arctan2(-right[1], right[0]), np.arctan2(forward[:, 0], forward[:, 1]))
    pitch = np.where(vertical, np.sign(forward[:, 2]) * np.pi / 2, np.arctan2(forward[:, 2], flat))
    flown = np.where(vertical[:, None], np.sign(forward[:, 2:]) * [0.0, 0.0, 1.0], forward)
    return np.degrees(yaw) % 360.0, np.degrees(pitch), flown


def shooting_points(
    surface: Surface,
    camera: Camera,
    vehicle: Vehicle,
    stand_off_m: float,
    overlap: float,
    settings: PlanSettings,
    airspace: Airspace,
    scene: Scene,
) -> Views:
    """Shooting points of one surface. Each looks perpendicularly where it can; where the gimbal, an obstacle
    or the height limits forbid that, from the least oblique free place that sees the same target."""
    footprint = camera.footprint_m(stand_off_m)
    places, uv = shooting_grid(surface, footprint, overlap, vehicle.sideways_error_m)
    targets = surface.to_world(uv)
    seen_at = surface.to_world(_nearest_inside(surface, uv))
    aimed = aim(surface, vehicle, stand_off_m, targets, seen_at, settings.max_incidence_deg, airspace, scene)
    views = tuple(
        View(surface.name, int(row), int(column), target, *aimed.found[i])
        for i, ((row, column), target) in enumerate(zip(places, targets, strict=True))
        if i in aimed.found
    )
    wanted = targets + stand_off_m * np.asarray(surface.plane.normal)
    return Views(stand_off_m, views, Counter(aimed.refused.values()), wanted)


@dataclass(frozen=True)
class Aimed:
    """Of each target by number: a pose that sees it and its incidence in degrees, or why there is none."""

    found: dict[int, tuple[CameraPose, float]]
    refused: dict[int, str]


def aim(
    surface: Surface,
    vehicle: Vehicle,
    stand_off_m: float,
    targets_m: Array,
    seen_at_m: Array,
    max_incidence_deg: float,
    airspace: Airspace,
    scene: Scene,
) -> Aimed:
    """The least oblique free place from which each target (N, 3) is looked at and its stand-in on the
    surface, seen_at_m (N, 3), is seen. What is refused has the reason of the perpendicular view."""
    right = surface.R_world_surface[:, :2] @ grid_turn(surface)[:, 0]
    found: dict[int, tuple[CameraPose, float]] = {}
    refused: dict[int, str] = {}
    left = np.arange(len(targets_m))
    for forward, incidence in _directions(surface, max_incidence_deg):
        if not left.size:
            break
        yaw, pitch, flown = camera_towards(forward[None], right)
        # Obliquely, a pixel stretches by 1 / cos(incidence): come closer to keep the ground sample distance,
        # where the position error has led farther off too.
        error = vehicle.position_error_m
        distance = (stand_off_m + error) * np.cos(incidence) - error
        positions = targets_m[left] - flown[0] * distance
        reasons = _reasons(
            positions, seen_at_m[left], float(pitch[0]), vehicle, airspace, scene, told=incidence == 0.0
        )
        for i, position, reason in zip(left.tolist(), positions, reasons, strict=True):
            if reason:
                refused.setdefault(i, reason)
                continue
            pose = CameraPose(
                position_m=tuple(round(float(x), 4) for x in position),
                yaw_deg=round(float(yaw[0]), 4) % 360.0,
                pitch_deg=round(float(pitch[0]), 4) + 0.0,  # no minus zero
            )
            found[i] = pose, math.degrees(incidence)
            refused.pop(i, None)
        left = left[reasons != ""]
    return Aimed(found, refused)


def _nearest_inside(surface: Surface, uv: Array) -> Array:
    """(N, 2) the points themselves, or where they lie off the outline its nearest points."""
    outline = outline_of(surface)
    lines = shapely.shortest_line(outline, shapely.points(uv))
    return np.asarray(shapely.get_coordinates(shapely.get_point(lines, 0)))


def _directions(surface: Surface, max_incidence_deg: float) -> list[tuple[Array, float]]:
    """View directions and incidences (radians), the perpendicular first, then rings of obliques. The most
    oblique still sees the nearer half of its footprint within the limit."""
    into = -np.asarray(surface.plane.normal)
    directions = [(into, 0.0)]
    u, v = np.asarray(surface.u), np.asarray(surface.v)
    for ring in np.arange(RING_DEG, max_incidence_deg + 1e-9, RING_DEG):
        incidence = np.radians(ring)
        for turn in np.radians(
            [90, 270, 0, 180, 45, 135, 225, 315]
        ):  # along v first: the image stays upright
            across = np.cos(turn) * u + np.sin(turn) * v
            directions.append((np.cos(incidence) * into + np.sin(incidence) * across, float(incidence)))
    return directions


def _reasons(
    positions: Array,
    targets: Array,
    pitch_deg: float,
    vehicle: Vehicle,
    airspace: Airspace,
    scene: Scene,
    told: bool,
) -> npt.NDArray[np.object_]:
    """(N,) why each place cannot be used, in words; empty where it can. Unless told, any word will do."""
    limits = vehicle.gimbal_pitch_min_deg, vehicle.gimbal_pitch_max_deg
    if not limits[0] - 1e-6 <= pitch_deg <= limits[1] + 1e-6:
        return np.full(
            len(positions), f"the gimbal tilts from {limits[0]:g}° to {limits[1]:g}°", dtype=object
        )
    words = {
        Block.FREE: "",
        Block.NEAR: f"closer than {airspace.inflation_m:.2f} m to something",
        Block.LOW: f"lower than {airspace.min_altitude_m:g} m above the ground",
        Block.HIGH: f"higher than {airspace.max_altitude_m:g} m above the ground",
        Block.UNKNOWN: UNSEEN,
        Block.FENCE: OUTSIDE,
        Block.NO_FLY: NO_FLY,
    }
    if told:
        reasons = np.array([words[Block(b)] for b in airspace.blocks(positions)], dtype=object)
    else:
        reasons = np.where(airspace.is_free(positions), "", "not free").astype(object)
    free = np.flatnonzero(reasons == "")
    if free.size:
        reasons[free[~scene.sees(positions[free], targets[free])]] = "hidden behind something"
    return reasons
