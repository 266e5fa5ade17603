"""Where the rays of a track meet, and how high over the surface."""

from dataclasses import dataclass, replace

import numpy as np

from schemas.camera import Camera
from tasks.stitching.bundle import ON_SURFACE, Bundle, State
from tasks.stitching.tracks import Index
from tasks.stitching.view import Array, View, rolled


def points(state: State, bundle: Bundle, noise_px: float) -> tuple[Array, Array]:
    """(T, 2) tracks where the present cameras see them, on average, and (T,) their heights over the surface:
    0 where they are held to it. noise_px: 1σ of a coordinate in a photo."""
    p, lean = rays(state, bundle)
    apart = Apart.of(p, lean, bundle.track, np.ones(len(p)))
    if bundle.spread == ON_SURFACE:
        return apart.at, np.zeros(len(apart.at))
    w = apart.agreed / (apart.power + (noise_px * bundle.units_per_px(state) / bundle.spread.sigma) ** 2)
    return np.asarray(apart.at + w[:, None] * apart.lean), np.asarray(w)


def rays(state: State, bundle: Bundle) -> tuple[Array, Array]:
    """(M, 2) and (M, 2) of the observations, as rays_of gives them."""
    p, lean = np.zeros((len(bundle.xy), 2)), np.zeros((len(bundle.xy), 2))
    for k in range(len(state.C)):
        mine = bundle.photo == k
        p[mine], lean[mine] = rays_of(bundle.view(state, k), bundle.xy[mine])
    return p, lean


def rays_of(view: View, taken_px: Array) -> tuple[Array, Array]:
    """(N, 2) where the rays of pixels as taken meet the surface, and (N, 2) how far along it they go per unit
    that it lies higher; 0 both where they miss."""
    principal, focal = np.asarray(view.camera.principal_px), view.camera.focal_px
    still = taken_px - rolled(taken_px[:, 1], view.camera)[:, None] * view.roll_px
    ideal = view.camera.undistort((still - principal) / focal) * focal + principal
    met = np.nan_to_num(replace(view, roll_px=np.zeros(2)).to_plane(ideal))
    height = 0.0 if view.relief is None else view.relief.at(met)[:, None]
    return met, (view.C[:2] - met) / (view.C[2] - height)


def as_taken(undistorted_px: Array, camera: Camera) -> Array:
    """(N, 2) pixels as taken, of those undistorted under a camera."""
    ideal = (undistorted_px - camera.principal_px) / camera.focal_px
    return np.asarray(camera.distort(ideal) * camera.focal_px + camera.principal_px)


@dataclass(frozen=True)
class Apart:
    """What the rays of each track say of its height: at height w they lie `off` + w · `leaning` apart."""

    at: Array  # (T, 2) mean place on the surface
    lean: Array  # (T, 2)
    agreed: Array  # (T,) height × power that the rays ask for
    power: Array  # (T,) squares of `leaning`
    left: float  # of all squares of `off`, those that no height explains

    @classmethod
    def of(cls, p: Array, lean: Array, track: Index, weight: Array) -> "Apart":
        total = np.bincount(track, weight)[:, None]

        def mean(values: Array) -> Array:
            return np.stack([np.bincount(track, weight * column) for column in values.T], axis=1) / total

        at, usual = mean(p), mean(lean)
        off, leaning = p - at[track], lean - usual[track]
        power = np.bincount(track, weight * (leaning**2).sum(axis=1)).clip(1e-12)
        agreed = np.asarray(-np.bincount(track, weight * (off * leaning).sum(axis=1)), np.float64)
        left = float(weight @ (off**2).sum(axis=1) - (agreed**2 / power).sum())
        return cls(at, usual, agreed, power, left)
