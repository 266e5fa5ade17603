"""A mosaic of simulated photos against what each of its photos truly shows."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import tifffile
from scipy.spatial import cKDTree

from artifacts import store
from schemas.mosaic import Mosaic, PhotoPlacement
from schemas.photo import Photo
from tasks.stitching.relief import HeightMap
from tests.benchmarks.wall_photos import GSD_M, WallPhotos

Array = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Errors:
    """Of the solved photos, after the best similarity, in photo pixels (GSD_M)."""

    rms_px: float
    worst_px: float
    d2: Array  # (photos,) of each photo's middle against its stated covariance
    gain: float  # worst relative error of a gain


def errors(mosaic: Mosaic, photos: WallPhotos, heights: HeightMap | None) -> Errors:
    solved = [
        (photo, placement)
        for photo, placement in zip(mosaic.photos, mosaic.placements, strict=True)
        if placement.status == "solved" and photo.name in photos.truth
    ]
    found = [
        _on_plane(mosaic, photo, placement, photos.truth[photo.name].px, heights)
        for photo, placement in solved
    ]
    real = [photos.truth[photo.name].uv_m for photo, _ in solved]
    off = _after_similarity(found, real) / GSD_M
    middle = [one[len(one) // 2, None] for one in found]
    drift = _after_similarity(middle, [one[len(one) // 2, None] for one in real])
    d2 = [
        float(e @ np.linalg.solve(np.array(placement.covariance_mm2), e))
        for (_, placement), e in zip(solved, drift * 1000.0, strict=True)
        if placement.covariance_mm2 is not None
    ]
    gains = np.array([placement.gain for _, placement in solved])
    gains *= np.array([photos.truth[photo.name].exposed for photo, _ in solved])
    gains /= np.exp(np.log(gains).mean())
    lengths = np.linalg.norm(off, axis=1)
    return Errors(
        float(np.sqrt(np.mean(lengths**2))),
        float(lengths.max()),
        np.array(d2),
        float(np.abs(gains - 1).max()),
    )


def _on_plane(
    mosaic: Mosaic, photo: Photo, placement: PhotoPlacement, px: Array, heights: HeightMap | None
) -> Array:
    """(N, 2) metres where the mosaic shows (N, 2) pixels of the photo as taken."""
    assert placement.H_mosaic_photo is not None
    camera = photo.camera
    ideal = camera.undistort((px - camera.principal_px) / camera.focal_px)
    flat = ideal * camera.focal_px + camera.principal_px
    q = np.column_stack([flat, np.ones(len(flat))]) @ np.array(placement.H_mosaic_photo).T
    xy = q[:, :2] / q[:, 2:]
    flat = np.asarray(xy * (mosaic.gsd_mm_px or 0.0) / 1000.0 * [1, -1] + mosaic.origin_uv_m)
    return flat if heights is None else heights.met(flat, np.asarray(placement.camera_uvw_m))


def heights_of(mosaic: Mosaic) -> HeightMap | None:
    of = mosaic.relief
    if of is None:
        return None
    w = np.load(store.current().path(of.heights)).astype(float)
    return HeightMap(w, of.left_m, of.bottom_m, of.cell_m)


def _in_photo(mosaic: Mosaic, k: int, xy: Array, heights: HeightMap | None) -> Array:
    """(N, 2) pixels of the k-th photo as taken that the mosaic shows at (N, 2) of its own."""
    placement, camera = mosaic.placements[k], mosaic.photos[k].camera
    if heights is not None:  # where the ray through what stands over the plane meets the plane
        gsd_m, C = (mosaic.gsd_mm_px or 0.0) / 1000.0, np.asarray(placement.camera_uvw_m)
        uv = xy * gsd_m * [1, -1] + mosaic.origin_uv_m
        share = (heights.at(uv) / C[2])[:, None]
        xy = ((uv - share * C[:2]) / (1 - share) - mosaic.origin_uv_m) / gsd_m * [1, -1]
    q = np.linalg.solve(np.array(placement.H_mosaic_photo), np.column_stack([xy, np.ones(len(xy))]).T).T
    ideal = (q[:, :2] / q[:, 2:] - camera.principal_px) / camera.focal_px
    return np.asarray(camera.distort(ideal) * camera.focal_px + camera.principal_px)


def _after_similarity(found: Sequence[Array], real: Sequence[Array]) -> Array:
    """(N, 2) what is left of found − real after the best turn, scale and shift."""
    z, w = np.concatenate(found) @ [1, 1j], np.concatenate(real) @ [1, 1j]
    columns = np.column_stack([z, np.ones(len(z))])
    left = columns @ np.linalg.lstsq(columns, w, rcond=None)[0] - w
    return np.column_stack([left.real, left.imag])


def seam_steps_px(mosaic: Mosaic, photos: WallPhotos, heights: HeightMap | None) -> tuple[Array, Array]:
    """At pixels where two photos meet: (N,) how far apart on the wall lies what they show there, and (N, 2)
    what one of them shows, in metres of the wall."""
    source = tifffile.imread(store.current().path(mosaic.source), level=0).astype(np.int64)
    across = np.argwhere((source[:, 1:] != source[:, :-1]) & (source[:, 1:] > 0) & (source[:, :-1] > 0))
    down = np.argwhere((source[1:] != source[:-1]) & (source[1:] > 0) & (source[:-1] > 0))
    beside, below = np.tile(across, 2) + np.array([0, 0, 0, 1]), np.tile(down, 2) + np.array([0, 0, 1, 0])
    seams = np.concatenate([beside, below])
    pairs = np.column_stack([source[seams[:, 0], seams[:, 1]], source[seams[:, 2], seams[:, 3]]]) - 1
    steps, places = [np.zeros(0)], [np.zeros((0, 2))]
    for i, j in np.unique(pairs, axis=0):
        if not {mosaic.photos[i].name, mosaic.photos[j].name} <= photos.truth.keys():
            continue
        at = seams[(pairs == [i, j]).all(axis=1)][:, [1, 0]].astype(float)
        shown = [photos.truth[mosaic.photos[k].name].see(_in_photo(mosaic, k, at, heights)) for k in (i, j)]
        steps.append(np.linalg.norm(shown[0] - shown[1], axis=1) / GSD_M)
        places.append(shown[0])
    return np.concatenate(steps), np.concatenate(places)


def on_crack(uv_m: Array, photos: WallPhotos) -> npt.NDArray[np.bool_]:
    """(N,) whether places of the wall lie on a crack or within a pixel beside it."""
    near = np.zeros(len(uv_m), np.bool_)
    for one in photos.cracks:
        away_m, at = cKDTree(one.uv_m).query(uv_m, distance_upper_bound=0.02)
        half_m = np.append(np.maximum(one.left_m, one.right_m), -np.inf)[at]
        near |= away_m < half_m + GSD_M
    return near
