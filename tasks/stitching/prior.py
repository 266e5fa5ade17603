"""What is known of each camera before any photo is matched, and of the plane's frame and scale.

Positions are as weak as they truly are: they choose candidates, anchor scale and place, and no more."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from schemas.camera import CameraPose
from schemas.geodesy import GeoOrigin
from schemas.photo import Photo
from schemas.surface import Surface, in_plane_axes
from tasks.stitching.view import FACING, Array, View

TILT_DEG = 2.0  # gimbal and compass
COMPASS_DEG = 10.0
SPREAD_SIGMAS = 2.0  # of the positions' error: from here on positions tell the yaw
UNKNOWN = np.full(3, np.nan)
DOWN_DEG = 40.0  # below the horizon: between walls, seen within 30° of squarely, and ground, seen at 45° too
OVER_TAKE_OFF = 0.5  # 1σ of the plane's height over the take-off (a roof, a deck), of the altitude over it
GUESSED_TILT_DEG = 8.0  # nobody said where the camera looked: at the surface, roughly


@dataclass(frozen=True)
class Prior:
    view: View
    sigma_position: Array  # (3,) along u, v, w; inf: not known
    sigma_rotation: Array  # (3,) radians, about the camera's x, y (tilts) and z (view axis); inf: not known
    velocity: Array = field(
        default_factory=lambda: UNKNOWN
    )  # (3,) units a second along u, v, w; NaN: not known

    @property
    def has_position(self) -> bool:
        return bool(np.isfinite(self.sigma_position[:2]).all())


@dataclass(frozen=True)
class PlaneFrame:
    """How the plane frame was come by."""

    surface: Surface | None  # the frame is this surface's own
    scale_from: str  # "poses", "GPS", "none"
    priors: tuple[Prior, ...]  # one a photo
    sigma_bias: Array  # (3,) error that all positions share
    view_guessed: bool = False  # GPS tells the places, but nobody said that the photos look down


def plane_frame(photos: Sequence[Photo], surface: Surface | None) -> PlaneFrame:
    """From poses and a surface; from poses alone; from GPS, over the ground or before a wall; or from
    nothing."""
    posed = [p for p in photos if p.pose is not None]
    if surface is not None and posed:
        R, origin = surface.R_world_surface, np.asarray(surface.origin_m)
        priors = tuple(_from_pose(p, R, origin, p.position_sigma_m) for p in photos)
        return PlaneFrame(surface, "poses", priors, _bias(priors))
    if len(posed) >= 2:
        return _own_plane(photos, [p.pose for p in posed if p.pose is not None])
    frame = _from_everyones_gps(photos)
    if frame is not None and any(p.has_position for p in frame.priors):
        return frame
    return placeless(photos)


def placeless(photos: Sequence[Photo]) -> PlaneFrame:
    """Where no photo's place is known."""
    return PlaneFrame(None, "none", tuple(_facing(p, 1.0) for p in photos), np.zeros(3))


def _from_everyones_gps(photos: Sequence[Photo]) -> PlaneFrame | None:
    """Over the ground, or before a wall; None where GPS does not tell places on the plane."""
    located = [p for p in photos if p.gps is not None]
    if len(located) < 2:
        return None
    poses = [pose for p in located if (pose := _pose_from_gps(p, located)) is not None]
    if len(poses) < 2 or _looks_down(poses):
        return _ground_plane(photos)
    if not any(pose.position_m[2] for pose in poses):
        return None  # before a wall half of the place is the height, which is not known
    return replace(_own_plane(_posed(photos, located), poses), scale_from="GPS")


def _bias(priors: Sequence[Prior]) -> Array:
    """Position errors of one flight walk together: as large in common as each is alone."""
    sigma = np.array([p.sigma_position for p in priors if p.has_position]).reshape(-1, 3)
    return np.asarray(np.where(np.isfinite(sigma), sigma, 0.0).max(axis=0, initial=0.0))


def _facing(photo: Photo, distance: float) -> Prior:
    tilt = np.radians(GUESSED_TILT_DEG)
    view = View(photo.camera, FACING, np.array([0.0, 0.0, distance]))
    return Prior(view, np.full(3, np.inf), np.array([tilt, tilt, np.inf]))


def _from_pose(photo: Photo, R_world_plane: Array, origin: Array, sigma_w: float) -> Prior:
    if photo.pose is None:
        return _facing(photo, 1.0)
    view = View(
        photo.camera,
        R_world_plane.T @ photo.pose.R_world_camera,
        (np.asarray(photo.pose.position_m) - origin) @ R_world_plane,
    )
    if view.C[2] <= 0 or view.R[2, 2] > -0.17:  # behind the surface, or looking along it (80°)
        return _facing(photo, 1.0)
    sigma = np.array([photo.position_sigma_m, photo.position_sigma_m, sigma_w])
    return Prior(view, sigma, np.radians([TILT_DEG, TILT_DEG, TILT_DEG]), _velocity(photo, R_world_plane))


def _velocity(photo: Photo, R_world_plane: Array) -> Array:
    return UNKNOWN if photo.velocity_m_s is None else np.asarray(photo.velocity_m_s) @ R_world_plane


def _looks_down(poses: Sequence[CameraPose]) -> bool:
    """Most photos look well down: at the ground, not at a wall or from below at a deck."""
    return bool(np.median([pose.R_world_camera[2, 2] for pose in poses]) < -np.sin(np.radians(DOWN_DEG)))


def _posed(photos: Sequence[Photo], located: Sequence[Photo]) -> list[Photo]:
    """With the poses that GPS and gimbal tell."""
    return [p if p.gps is None else p.model_copy(update={"pose": _pose_from_gps(p, located)}) for p in photos]


def _pose_from_gps(photo: Photo, located: Sequence[Photo]) -> CameraPose | None:
    """East, north and height above take-off from the mean of all; None without gimbal angles."""
    if photo.gps is None or photo.view_deg is None:
        return None
    latitude, longitude, height = photo.gps
    east, north, _ = _origin_of(located).to_enu(latitude, longitude, 0.0)
    yaw, pitch, roll = photo.view_deg
    return CameraPose(position_m=(east, north, height), yaw_deg=yaw, pitch_deg=pitch, roll_deg=roll)


def _origin_of(located: Sequence[Photo]) -> GeoOrigin:
    gps = [p.gps for p in located if p.gps is not None]
    return GeoOrigin(
        latitude_deg=float(np.mean([g[0] for g in gps])), longitude_deg=float(np.mean([g[1] for g in gps]))
    )


def _own_plane(photos: Sequence[Photo], poses: Sequence[CameraPose]) -> PlaneFrame:
    """A plane square to the mean view at an unknown distance: 1 m until the matches tell."""
    normal = -np.mean([pose.R_world_camera[:, 2] for pose in poses], axis=0)
    normal /= np.linalg.norm(normal)
    u, v = in_plane_axes(normal)
    R = np.column_stack([u, v, normal])
    positions = np.array([pose.position_m for pose in poses])
    origin = positions.mean(axis=0) - normal * (1.0 + float(np.ptp(positions @ normal)))
    priors = tuple(_aslant(_from_pose(p, R, origin, np.inf)) for p in photos)
    return PlaneFrame(None, "poses", priors, _bias(priors))


def _aslant(prior: Prior) -> Prior:
    """How the plane lies to the mean view is guessed: the tilts are no better known."""
    tilts = np.maximum(prior.sigma_rotation, np.radians([GUESSED_TILT_DEG, GUESSED_TILT_DEG, 0.0]))
    return replace(prior, sigma_rotation=tilts)


def _ground_plane(photos: Sequence[Photo]) -> PlaneFrame:
    """Level ground, u east, v north; yaw and tilt from the gimbal where it tells. It lies at the height of
    the take-off, but for an error that all altitudes share: where the positions' distances tell the scale
    better, the altitudes do not count."""
    gps = [p.gps for p in photos if p.gps is not None]
    origin = _origin_of([p for p in photos if p.gps is not None])
    altitudes = [g[2] for g in gps if g[2] > 1.0]
    usual = float(np.median(altitudes)) if altitudes else None
    east_north = np.array([origin.to_enu(g[0], g[1], 0.0)[:2] for g in gps])
    spread = float(np.linalg.norm(east_north.std(axis=0)))
    # Yaw in photos' headers is at times 180° off (DJI, gimbal near −90°): far-flung positions tell it better.
    trust_yaw = spread < SPREAD_SIGMAS * max(p.position_sigma_m for p in photos)
    priors = tuple(_from_gps(p, origin, usual, trust_yaw) for p in photos)
    bias = _bias(priors)
    bias[2] = OVER_TAKE_OFF * (usual or 0.0)
    return PlaneFrame(None, "GPS", priors, bias, all(p.view_deg is None for p in photos))


def _from_gps(photo: Photo, origin: GeoOrigin, usual_altitude_m: float | None, trust_yaw: bool) -> Prior:
    height = usual_altitude_m or 1.0
    if photo.gps is None:
        return _facing(photo, height)
    if photo.gps[2] > 1.0:
        height = photo.gps[2]
    east, north, _ = origin.to_enu(photo.gps[0], photo.gps[1], 0.0)
    sigma = photo.position_sigma_m
    # A relative altitude is barometric: good to a metre or some per cent, beside what all have in common.
    position = np.array([sigma, sigma, max(0.05 * height, 0.5) if usual_altitude_m else np.inf])
    tilt = np.radians(TILT_DEG)
    if photo.view_deg is None:  # taken to look down, but not so surely that its altitude is its distance
        view = View(photo.camera, FACING, np.array([east, north, height]))
        guessed = np.radians(GUESSED_TILT_DEG)
        return Prior(view, np.array([sigma, sigma, np.inf]), np.array([guessed, guessed, np.inf]))
    yaw, pitch, roll = photo.view_deg
    pose = CameraPose(position_m=(east, north, height), yaw_deg=yaw, pitch_deg=pitch, roll_deg=roll)
    if pose.R_world_camera[2, 2] > -0.17:
        return _facing(photo, height)
    view = View(photo.camera, pose.R_world_camera, np.array([east, north, height]))
    turned = np.array([tilt, tilt, np.radians(COMPASS_DEG) if trust_yaw else np.inf])
    return Prior(view, position, turned, _velocity(photo, np.eye(3)))
