"""The bundle: cameras above a surface, points on it, where the photos show them, and what is known before.

Residuals are pixels of the photos as taken, through the full model of the lens."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from schemas.camera import Camera
from tasks.stitching.derivatives import differentiate
from tasks.stitching.prior import Prior
from tasks.stitching.relief import HeightMap
from tasks.stitching.tracks import Index, Observations
from tasks.stitching.view import FACING, Array, View, rolled, rotation, rotation_vector, with_lens

PER_PHOTO = 8  # unknowns: rotation, position, rolling shutter
PER_CAMERA = 4  # ln focal length, k1, principal point
# 1σ of a lens, where its principal point is stated (a calibration) and where not: what k1 may move the
# photo's edge by, as a share of its radius; and where the axis meets the sensor, in focal lengths.
K1_AT_EDGE, CENTRE = {True: 0.002, False: 0.03}, {True: 0.0005, False: 0.005}
ALIKE = 25.0  # so many points are taken to err alike (relief, shutter, lens), and to lie as high
HELD_HEIGHT = 1e-9  # 1σ, plane units, of points that lie on the surface
LEAST_HEIGHT = 0.1  # RMS, of what it was before
HORIZON = 50.0  # times farther away than a camera is from the surface, points tell nothing of it
HELD = 0.01  # 1σ, of its distance and in radians, of the photo that holds a bundle without positions


class Spread(NamedTuple):
    """Of the points' heights over the surface, before the present rays tell them."""

    sigma: float  # 1σ, plane units
    determined: float  # how many of them the rays determine


ON_SURFACE = Spread(HELD_HEIGHT, 0.0)


@dataclass(frozen=True)
class State:
    R: Array  # (n, 3, 3)
    C: Array  # (n, 3)
    roll: Array  # (n, 2) pixels that the rolling shutter moves the last row by against the first
    lens: Array  # (cameras, 4) ln of the focal length over the nominal one, k1, principal point
    bias: Array  # (3,)
    X: Array  # (tracks, 2)
    w: Array  # (tracks,) heights of the points over the surface


@dataclass(frozen=True)
class Bundle:
    """What does not change while iterating. n photos, M observations."""

    photo: Index  # (M,)
    track: Index  # (M,)
    xy: Array  # (M, 2) pixels as taken
    rolled: Array  # (M,) −½..½: instant of the row
    cameras: tuple[Camera, ...]  # distinct ones, nominal
    camera_of: Index  # (n,)
    sigma_log_focal: Array  # (cameras,)
    prior_R: Array  # (n, 3, 3)
    prior_C: Array  # (n, 3)
    weight_rotation: Array  # (n, 3) 1/σ²; 0: not known
    weight_position: Array  # (n, 3)
    weight_bias: Array  # (3,)
    velocity: Array  # (n, 3) plane units a second; NaN: not known
    sigma_roll: Array  # (2,) px
    expected_roll: Array  # (n, 2) px
    relief: HeightMap | None
    spread: Spread = ON_SURFACE

    @property
    def shared(self) -> int:
        return PER_CAMERA * len(self.cameras) + 3

    def units_per_px(self, state: State) -> float:
        """Plane units that a pixel of the usual photo covers."""
        focal = np.array([c.focal_px for c in self.cameras])[self.camera_of]
        return float(np.median(state.C[:, 2] / focal))

    def view(self, state: State, k: int) -> View:
        c = int(self.camera_of[k])
        camera = with_lens(self.cameras[c], state.lens[c])
        return View(camera, state.R[k], state.C[k], state.roll[k], self.relief)


def build_bundle(
    views: Sequence[View],
    cameras: tuple[Camera, ...],
    observations: Observations,
    priors: Sequence[Prior],
    sigma_bias: Array,
    focal_sigmas: Sequence[float],
    sigma_roll: Array,
    expected_roll: Array,
) -> Bundle:
    keys = [camera_key(camera) for camera in cameras]
    camera_of = np.array([keys.index(camera_key(v.camera)) for v in views], np.int64)
    xy = observations.xy.copy()
    when = np.zeros(len(xy))
    for k, view in enumerate(views):
        mine = observations.photo == k
        if not view.camera.is_ideal:
            principal = np.asarray(view.camera.principal_px)
            ideal = (xy[mine] - principal) / view.camera.focal_px
            xy[mine] = view.camera.distort(ideal) * view.camera.focal_px + principal
        when[mine] = rolled(xy[mine, 1], view.camera)
    position = np.stack([p.sigma_position for p in priors])
    rotations = np.stack([p.sigma_rotation for p in priors])
    prior_C = np.stack([p.view.C for p in priors])
    prior_R = np.stack([p.view.R for p in priors])
    if not np.isfinite(position).any():  # no position known: one photo holds still, at its first guess
        root = int(np.bincount(observations.photo).argmax())
        prior_C[root], prior_R[root] = views[root].C, _upright(views[root].R)
        position[root] = HELD * views[root].C[2]
        rotations[root, 2] = HELD
    return Bundle(
        photo=observations.photo,
        track=observations.track,
        xy=xy,
        rolled=when,
        cameras=cameras,
        camera_of=camera_of,
        sigma_log_focal=np.array([focal_sigmas[int(np.argmax(camera_of == c))] for c in range(len(cameras))]),
        prior_R=prior_R,
        prior_C=prior_C,
        weight_rotation=np.where(np.isfinite(rotations), rotations, np.inf) ** -2.0,
        weight_position=np.where(np.isfinite(position), position, np.inf) ** -2.0,
        weight_bias=np.maximum(sigma_bias, 1e-9) ** -2.0,
        velocity=np.stack([p.velocity for p in priors]),
        sigma_roll=sigma_roll,
        expected_roll=expected_roll,
        relief=views[0].relief,
    )


def camera_key(camera: Camera) -> tuple[object, ...]:
    """Its fields alone: pydantic's own comparison trips over the matrices cached on the model."""
    return tuple(camera.model_dump().values())


def _upright(R: Array) -> Array:
    """Facing the plane squarely, turned about w as R is."""
    angle = np.arctan2(R[1, 0], R[0, 0])
    return np.asarray(rotation(np.array([0.0, 0.0, angle])) @ FACING)


def height_weight(state: State, bundle: Bundle) -> float:
    """1/σ² of the heights: σ² is their squares over how many the rays determine (MacKay 1992), always those
    of now. Held to what they were, it would hold the scale of the whole to what it was."""
    if bundle.spread == ON_SURFACE:
        return 1.0 / HELD_HEIGHT**2
    return bundle.spread.determined / ALIKE / height_squares(state, bundle)


def height_squares(state: State, bundle: Bundle) -> float:
    """Of all heights; not quite none, which would hold them at none."""
    least = LEAST_HEIGHT * bundle.spread.sigma
    return float((state.w**2).sum() + bundle.spread.determined * least**2)


def prior_errors(state: State, bundle: Bundle) -> tuple[Array, Array]:
    turned = rotation_vector(np.einsum("nji,njk->nik", bundle.prior_R, state.R))
    return turned, state.C - bundle.prior_C - state.bias


def nominal_lens(cameras: Sequence[Camera]) -> Array:
    return np.array([(0.0, c.k1, *c.principal_px) for c in cameras])


def sigma_lens(bundle: Bundle) -> Array:
    """(cameras, 4) 1σ before any photo was seen."""
    sigmas = []
    for camera, sigma_log_focal in zip(bundle.cameras, bundle.sigma_log_focal, strict=True):
        radius = np.hypot(camera.width_px, camera.height_px) / 2 / camera.focal_px
        calibrated = camera.cx_px is not None
        centre_px = CENTRE[calibrated] * camera.focal_px
        sigmas.append((sigma_log_focal, K1_AT_EDGE[calibrated] / radius**2, centre_px, centre_px))
    return np.array(sigmas)


def _ideal(state: State, bundle: Bundle) -> tuple[Array, Array]:
    """Ideal image coordinates (M, 2) and points in camera (M, 3)."""
    R, C = state.R[bundle.photo], state.C[bundle.photo]
    height = np.zeros(len(state.X)) if bundle.relief is None else bundle.relief.at(state.X)
    offset = np.column_stack([state.X, height + state.w])[bundle.track] - C
    in_camera = np.einsum("mji,mj->mi", R, offset)
    z = np.where(in_camera[:, 2] > 1e-9, in_camera[:, 2], np.nan)
    return in_camera[:, :2] / z[:, None], in_camera


def met(state: State, bundle: Bundle) -> npt.NDArray[np.bool_]:
    """(M,) whose points lie before their cameras, and not so far off that these look along the surface."""
    _, in_camera = _ideal(state, bundle)
    depth, height = in_camera[:, 2], state.C[bundle.photo, 2]
    return np.asarray((depth > 1e-9) & (depth < HORIZON * height))


def residuals(state: State, bundle: Bundle) -> Array:
    xy, _ = _ideal(state, bundle)
    residual = state.roll[bundle.photo] * bundle.rolled[:, None] - bundle.xy
    of = bundle.camera_of[bundle.photo]
    for c, nominal in enumerate(bundle.cameras):
        mine = of == c
        camera = with_lens(nominal, state.lens[c])
        residual[mine] += camera.distort(xy[mine]) * camera.focal_px + camera.principal_px
    return _as_taken(residual, state, bundle)


def _as_taken(off: Array, state: State, bundle: Bundle) -> Array:
    """(M, 2) in pixels of the photo as taken, of what the row that was seen, rather than the row foretold,
    makes of the rolling shutter: left so, noise in the rows would shrink as the shutter's stretch grows, and
    stretch every photo."""
    slope = (state.roll / _heights_px(bundle)[:, None])[bundle.photo]
    y = off[:, 1] / (1.0 - slope[:, 1])
    return np.column_stack([off[:, 0] + slope[:, 0] * y, y])


def _heights_px(bundle: Bundle) -> Array:
    """(n,) of the photos."""
    return np.array([float(c.height_px) for c in bundle.cameras])[bundle.camera_of]


@dataclass(frozen=True)
class Jacobians:
    camera: Array  # (M, 2, 12) by what the observation's photo and its lens have
    point: Array  # (M, 2, 3) along the surface, and off it

    @property
    def pose(self) -> Array:
        """(M, 2, 8) by rotation (in the camera's frame, radians), position and rolling shutter."""
        return self.camera[:, :, :PER_PHOTO]

    @property
    def lens(self) -> Array:
        """(M, 2, 4) by the numbers of State.lens."""
        return self.camera[:, :, PER_PHOTO:]


def linearise(state: State, bundle: Bundle) -> tuple[Array, Jacobians]:
    xy, in_camera = _ideal(state, bundle)
    of = bundle.camera_of[bundle.photo]
    distorted, by_k1, by_ideal = np.empty_like(xy), np.empty_like(xy), np.empty((len(xy), 2, 2))
    for c, nominal in enumerate(bundle.cameras):
        mine = of == c
        lens = with_lens(nominal, state.lens[c]).distortion
        distorted[mine], by_k1[mine], by_ideal[mine] = (
            lens.distort(xy[mine]),
            lens.by_k1(xy[mine]),
            lens.slope(xy[mine]),
        )
    focal = (np.array([c.focal_px for c in bundle.cameras]) * np.exp(state.lens[:, 0]))[bundle.camera_of]
    rolled = state.roll[bundle.photo] * bundle.rolled[:, None]
    seen = focal[bundle.photo, None] * distorted + state.lens[of, 2:] + rolled
    residual = _as_taken(seen - bundle.xy, state, bundle)
    camera, point = differentiate(
        bundle.photo,
        bundle.track,
        state.R,
        focal,
        _heights_px(bundle),
        state.roll,
        bundle.rolled,
        in_camera,
        distorted,
        by_k1,
        by_ideal,
        np.zeros_like(state.X) if bundle.relief is None else bundle.relief.slope(state.X),
        residual,
    )
    return residual, Jacobians(camera, point)
