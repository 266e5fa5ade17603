"""Heights of many more points than an adjustment takes: of all that photos show alike where it must lie."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.stats import chi2

from schemas.camera import Camera
from tasks.stitching.heights import Heights
from tasks.stitching.matching import match_guided
from tasks.stitching.pairs import Edge, PhotoFeatures
from tasks.stitching.rays import Apart, as_taken, rays_of
from tasks.stitching.relief import HeightMap
from tasks.stitching.tracks import build_tracks
from tasks.stitching.verification import tolerance_px
from tasks.stitching.view import View

OUTLIER = 4.0  # sigma: rays that miss one another by more show different points


def denser(
    views: Sequence[View],
    relief: HeightMap,
    usual: float,
    edges: Sequence[Edge],
    features: Sequence[PhotoFeatures],
    cameras: Sequence[Camera],
    ransac_px: float,
) -> Heights:
    """views: adjusted, over the plane; relief: of the points that they were adjusted to, `usual` high (RMS).
    features: undistorted under `cameras`; ransac_px: how far from where it is expected a point may be."""
    seen = [
        replace(f, xy=as_taken(f.xy.astype(float), camera).astype(np.float32))
        for f, camera in zip(features, cameras, strict=True)
    ]
    on_relief = [replace(view, relief=relief) for view in views]
    places = {
        a: rays_of(on_relief[a], seen[a].xy.astype(float))[0] for a in sorted({edge.a for edge in edges})
    }
    found = [
        replace(
            edge,
            matches=match_guided(
                seen[edge.a].descriptors,
                seen[edge.b].descriptors,
                on_relief[edge.b].to_photo(places[edge.a]),
                seen[edge.b].xy,
                tolerance_px(cameras[edge.b], ransac_px),
            ),
        )
        for edge in edges
    ]
    observations = build_tracks(found, seen)
    photo, track = observations.photo, observations.track
    p, lean = np.zeros((len(photo), 2)), np.zeros((len(photo), 2))
    for i in np.unique(photo):
        p[photo == i], lean[photo == i] = rays_of(views[i], observations.xy[photo == i])
    apart = Apart.of(p, lean, track, np.ones(len(track)))
    w = apart.agreed / apart.power
    at = apart.at + w[:, None] * apart.lean
    missed = np.bincount(track, ((p + w[track, None] * lean - at[track]) ** 2).sum(axis=1))
    free = 2 * np.bincount(track) - 3
    noise = float(np.median(missed / chi2.median(free)))  # plane units²
    sigma = np.sqrt(noise / apart.power)
    good = (missed < OUTLIER**2 * free * noise) & (np.abs(w) < OUTLIER * np.hypot(sigma, usual))
    return Heights(at[good], w[good], sigma[good], usual)
