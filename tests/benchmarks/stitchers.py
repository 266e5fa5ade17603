"""Other stitchers on the same photos. None says where its pixels lie, so their mosaics are read: features of
each photo are found again in the mosaic, and where they lie is held against the truth."""

import importlib
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt
from scipy.interpolate import RegularGridInterpolator

from tests.benchmarks.wall_photos import GSD_M, Shown, WallPhotos

Array = npt.NDArray[np.float64]
Pixels = npt.NDArray[np.uint8]
FEWEST = 30  # points of a photo found again in a mosaic, or it is not in it


@dataclass(frozen=True)
class PeerRun:
    used: int  # photos that are in its mosaic
    similarity_px: float  # RMS after the best similarity, in photo pixels; NaN: nothing to compare
    homography_px: float
    cpu_s: float


def run_peer(
    stitch: Callable[[list[Path], Path], Pixels | None], photos: WallPhotos, folder: Path
) -> PeerRun:
    began = time.process_time()
    mosaic = stitch([photos.folder / name for name in sorted(photos.truth)], folder)
    cpu_s = time.process_time() - began
    xy, uv, used = _found_again(mosaic, photos) if mosaic is not None else (np.zeros((0, 2)),) * 2 + (0,)
    if used == 0:
        return PeerRun(0, float("nan"), float("nan"), cpu_s)
    columns = np.column_stack([xy @ [1, -1j], np.ones(len(xy))])
    w = uv @ [1, 1j]
    off = np.abs(columns @ np.linalg.lstsq(columns, w, rcond=None)[0] - w)
    H, _ = cv2.findHomography(xy, uv, 0)
    q = np.column_stack([xy, np.ones(len(xy))]) @ H.T
    bent = np.linalg.norm(q[:, :2] / q[:, 2:] - uv, axis=1)
    rms = [float(np.sqrt(np.mean(e**2))) / GSD_M for e in (off, bent)]
    return PeerRun(used, rms[0], rms[1], cpu_s)


def scans(paths: list[Path], _: Path) -> Pixels | None:
    return _opencv(cv2.Stitcher_SCANS, paths)


def panorama(paths: list[Path], _: Path) -> Pixels | None:
    return _opencv(cv2.Stitcher_PANORAMA, paths)


def _opencv(mode: int, paths: list[Path]) -> Pixels | None:
    status, mosaic = cv2.Stitcher.create(mode).stitch([cv2.imread(str(p)) for p in paths])
    return mosaic if status == cv2.Stitcher_OK else None


def affine_stitcher(paths: list[Path], _: Path) -> Pixels | None:
    package = importlib.import_module("stitching")
    try:
        return np.asarray(package.AffineStitcher(crop=False).stitch([str(p) for p in paths]))
    except Exception as error:  # its own, for photos that it cannot stitch
        print(f"AffineStitcher: {error}")
        return None


def py_orthomosaic(paths: list[Path], folder: Path) -> Pixels | None:
    package = importlib.import_module("orthomosaic")
    for path in paths:
        (folder / path.name).symlink_to(path.resolve())
    target = folder / "ortho.tif"
    try:
        package.build_orthomosaic(str(folder), str(target), package.Options())
    except Exception as error:
        print(f"pyOrthomosaic: {error}")
        return None
    return cv2.imread(str(target))


PEERS: dict[str, Callable[[list[Path], Path], Pixels | None]] = {
    "OpenCV SCANS": scans,
    "OpenCV PANORAMA": panorama,
    "stitching AffineStitcher": affine_stitcher,
    "pyOrthomosaic": py_orthomosaic,
}
NEEDS = {"stitching AffineStitcher": "stitching", "pyOrthomosaic": "orthomosaic"}


def _found_again(mosaic: Pixels, photos: WallPhotos) -> tuple[Array, Array, int]:
    """(N, 2) pixels of the mosaic, (N, 2) metres on the wall that belong there, photos seen in it."""
    xy, described = _features(mosaic, 20_000)
    found, real = [np.zeros((0, 2))], [np.zeros((0, 2))]
    for name, shown in photos.truth.items():
        own, own_described = _features(cv2.imread(str(photos.folder / name)), 3000)
        pairs = cv2.BFMatcher().knnMatch(own_described, described, k=2)
        good = [p[0] for p in pairs if len(p) == 2 and p[0].distance < 0.8 * p[1].distance]
        if len(good) < FEWEST:
            continue
        a, b = own[[m.queryIdx for m in good]], xy[[m.trainIdx for m in good]]
        _, mask = cv2.findHomography(a, b, cv2.USAC_MAGSAC, 5.0)
        inliers = np.zeros(len(a), bool) if mask is None else mask.ravel().astype(bool)
        if inliers.sum() >= FEWEST:
            found.append(b[inliers])
            real.append(_on_wall(shown, a[inliers]))
    return np.concatenate(found), np.concatenate(real), len(found) - 1


def _features(image: Pixels, most: int) -> tuple[Array, npt.NDArray[np.float32]]:
    points, described = cv2.SIFT.create(most, contrastThreshold=0.01).detectAndCompute(image, None)
    return np.array([p.pt for p in points], np.float64).reshape(-1, 2), described


def _on_wall(shown: Shown, px: Array) -> Array:
    x, y = np.unique(shown.px[:, 0]), np.unique(shown.px[:, 1])
    table = shown.uv_m.reshape(len(y), len(x), 2)
    return np.asarray(
        RegularGridInterpolator((y, x), table, method="cubic")(px[:, ::-1].clip(0, [y[-1], x[-1]]))
    )
