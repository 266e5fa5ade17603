"""Rows of `make bench-stitching ARGS=--features`: our features beside OpenCV's SIFT, asked for as many in the
same way (spread over the photo, RootSIFT), on simulated photos: where a pixel lies on the wall is known."""

import time
from collections.abc import Callable, Iterator
from itertools import combinations
from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt

from schemas.camera import Camera
from schemas.settings import StitchSettings
from tasks.photos.scale_space import Points
from tasks.photos.sift import CONTRAST, DETECTION_PX, Keypoints, _root, _spread, detect_features
from tasks.stitching.matching import match
from tests.benchmarks.table import Row, row
from tests.benchmarks.wall_photos import CASES, GSD_M, WallPhotos, wall_photos

GRID, MEGAPIXELS = (3, 2), 8.0
RIGHT_PX = 3.0  # a match that lies off by more is a wrong one

Grey = npt.NDArray[np.uint8]
Detect = Callable[[Grey, Camera, int], Keypoints]


def rows(cache: Path) -> Iterator[Row]:
    for case in CASES:
        if case.name not in ("plane", "faint"):
            continue
        photos = wall_photos(case, *GRID, MEGAPIXELS, 1, cache)
        ours, theirs = _judged(photos, detect_features), _judged(photos, opencv_features)
        data = f"simulated, {len(photos.truth)} × {MEGAPIXELS:g} MP, {case.what}"
        for (what, unit), mine, peer in zip(WHAT.items(), ours, theirs, strict=True):
            yield row(what, mine, unit, None, data, "1", "OpenCV SIFT", peer)


WHAT = {
    "features: right matches a pair of photos": "1",
    "features: wrong of all matches": "%",
    "features: how far a right match lies off, median": "px",
    "features: CPU time a photo": "s",
}


def _judged(photos: WallPhotos, detect: Detect) -> tuple[float, float, float, float]:
    """The numbers that WHAT names."""
    names, most = sorted(photos.truth), StitchSettings().features
    greys = [cv2.imread(str(photos.folder / name), cv2.IMREAD_GRAYSCALE) for name in names]
    detect(greys[0], photos.camera, most)  # compiled, or loaded, before the time counts
    began = time.process_time()
    found = [detect(grey, photos.camera, most) for grey in greys]
    spent_s = (time.process_time() - began) / len(names)
    on_wall = [
        photos.truth[n].see(_as_taken(one.xy, photos.camera)) for n, one in zip(names, found, strict=True)
    ]
    off_px, pairs = [], 0
    for a, b in combinations(range(len(names)), 2):
        matches = match(found[a].descriptors, found[b].descriptors)
        off = np.linalg.norm(on_wall[a][matches[:, 0]] - on_wall[b][matches[:, 1]], axis=1) / GSD_M
        if (off < RIGHT_PX).mean() < 0.5:  # they hardly overlap
            continue
        off_px.append(off)
        pairs += 1
    off = np.concatenate(off_px)
    right = off < RIGHT_PX
    return right.sum() / pairs, 100 * (~right).mean(), float(np.median(off[right])), spent_s


def _as_taken(xy: npt.NDArray[np.float32], camera: Camera) -> npt.NDArray[np.float64]:
    ideal = (xy.astype(np.float64) - camera.principal_px) / camera.focal_px
    return np.asarray(camera.distort(ideal) * camera.focal_px + camera.principal_px)


def opencv_features(grey: Grey, camera: Camera, most: int) -> Keypoints:
    height, width = grey.shape
    shrink = min(1.0, (DETECTION_PX / (width * height)) ** 0.5)
    size = round(width * shrink), round(height * shrink)
    small = cv2.resize(grey, size, interpolation=cv2.INTER_AREA)
    sift = cv2.SIFT.create(contrastThreshold=CONTRAST, enable_precise_upscale=True)
    keypoints = sift.detect(small, None)
    x, y = np.array([k.pt for k in keypoints]).reshape(-1, 2).T
    response, none = np.array([k.response for k in keypoints]), np.zeros(len(keypoints))
    chosen = _spread(Points(x, y, none.astype(np.int32), none, response), *size, most)
    kept, descriptors = sift.compute(small, [keypoints[i] for i in chosen])
    step = np.array([width, height]) / size
    pixels = (np.array([k.pt for k in kept]) + 0.5) * step - 0.5
    ideal = camera.undistort((pixels - camera.principal_px) / camera.focal_px)
    return Keypoints(
        xy=(ideal * camera.focal_px + camera.principal_px).astype(np.float32),
        scale=(np.array([k.size for k in kept]) * step.mean()).astype(np.float32),
        angle=np.array([k.angle for k in kept], np.float32),
        response=np.array([k.response for k in kept], np.float32),
        descriptors=_root(np.asarray(descriptors, np.float32)),
    )
