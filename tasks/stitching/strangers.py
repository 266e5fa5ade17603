"""Positions that cannot be right: a photo whose GPS had no fix yet, or that bears another's position."""

from collections.abc import Sequence

import numpy as np
from scipy.spatial import cKDTree

from schemas.geodesy import GeoOrigin
from schemas.photo import Photo
from tasks.stitching.view import Array

FEWEST = 5  # places that can outvote one
SAME = 3.0  # sigma of the positions: nearer ones are one place, at which a vehicle hovered
ALONE = 10.0  # times farther from the nearest than three quarters of the places are
SIGMAS = 10.0  # and so many of the positions' error


def strangers(photos: Sequence[Photo]) -> dict[int, float]:
    """Metres from the nearest other place, of photos that lie far from all: farther than the others are
    spread, or many times farther than most of these from their nearest."""
    which, at = _positions(photos)
    if not which:
        return {}
    sigma = max(photos[i].position_sigma_m for i in which)
    _, place = np.unique(np.rint(at / (SAME * sigma)), axis=0, return_inverse=True)
    count = np.bincount(place.ravel())
    if len(count) < FEWEST:
        return {}
    places = np.stack([np.bincount(place.ravel(), column) / count for column in at.T], axis=1)
    nearest = cKDTree(places).query(places, k=2)[0][:, 1]
    usual = ALONE * float(np.percentile(nearest, 75))
    far = {}
    for k in np.flatnonzero(nearest > SIGMAS * sigma):
        spread = float(np.linalg.norm(np.ptp(np.delete(places, k, axis=0), axis=0)))
        if nearest[k] > min(usual, spread):
            far[int(k)] = float(nearest[k])
    return {i: far[int(k)] for i, k in zip(which, place.ravel(), strict=True) if int(k) in far}


def _positions(photos: Sequence[Photo]) -> tuple[list[int], Array]:
    """Which photos have one, and (n, 3) metres: poses where there are any, else east and north by GPS."""
    posed = [i for i, photo in enumerate(photos) if photo.pose is not None]
    if posed:
        return posed, np.array([pose.position_m for i in posed if (pose := photos[i].pose) is not None])
    located = [(i, photo.gps) for i, photo in enumerate(photos) if photo.gps is not None]
    if not located:
        return [], np.zeros((0, 3))
    latitude, longitude, _ = np.median([gps for _, gps in located], axis=0)
    origin = GeoOrigin(latitude_deg=float(latitude), longitude_deg=float(longitude))
    return [i for i, _ in located], np.array([origin.to_enu(g[0], g[1], 0.0) for _, g in located])
