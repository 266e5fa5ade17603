"""Photo sets on disk, ingested and described, with the truth beside."""

from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt

from artifacts import store
from schemas.camera import Camera, CameraPose
from schemas.mosaic import Mosaic
from schemas.photo import Features, Photo
from schemas.settings import StitchSettings
from schemas.surface import Surface
from tasks.photos.task import features, ingest
from tasks.stitching.task import stitch
from tests.stitching.scenes import plane_points

Array = npt.NDArray[np.float64]
SETTINGS = StitchSettings(features=2000)


@dataclass(frozen=True)
class PhotoSet:
    photos: tuple[Photo, ...]
    features: tuple[Features, ...]
    truth: dict[str, tuple[Camera, CameraPose]]  # by the photo's name

    def plus(self, other: "PhotoSet") -> "PhotoSet":
        return PhotoSet(self.photos + other.photos, self.features + other.features, self.truth | other.truth)

    def without(self, names: set[str]) -> "PhotoSet":
        kept = [k for k, photo in enumerate(self.photos) if photo.name not in names]
        return PhotoSet(
            tuple(self.photos[k] for k in kept), tuple(self.features[k] for k in kept), self.truth
        )

    def stitch(self, surface: Surface | None, settings: StitchSettings = SETTINGS) -> Mosaic:
        mosaic: Mosaic = stitch.bare("wall", surface, self.photos, self.features, settings)
        return mosaic


def photo_set(
    folder: Path,
    images: dict[str, npt.NDArray[np.uint8]],
    camera: Camera,
    truth: dict[str, tuple[Camera, CameraPose]],
    poses: dict[str, CameraPose] | None = None,
    sigma_m: float = 0.1,
) -> PhotoSet:
    """`camera` is what the crew knows of it; `poses` what the vehicle reported."""
    photos, described = [], []
    for name, image in images.items():
        path = folder / name
        cv2.imwrite(str(path), image[..., ::-1])
        pose = None if poses is None else poses[name]
        photo: Photo = ingest.bare(store.current().put(path), name, "wall", camera, pose, sigma_m)
        photos.append(photo)
        described.append(features.bare(photo, SETTINGS))
    return PhotoSet(tuple(photos), tuple(described), truth)


def errors_px(mosaic: Mosaic, truth: dict[str, tuple[Camera, CameraPose]], gauge: bool) -> Array:
    """(N,) distances in photo pixels between where the mosaic shows points of the solved photos and where
    they are; with `gauge` after the best similarity (1 where the mosaic has no scale)."""
    found, real = [], []
    gsd_m = (mosaic.gsd_mm_px or 1000.0) / 1000.0
    pixel_m = 1.0
    for photo, placement in zip(mosaic.photos, mosaic.placements, strict=True):
        if placement.status != "solved" or placement.H_mosaic_photo is None:
            continue
        camera, pose = truth[photo.name]
        x, y = np.meshgrid(np.linspace(0, camera.width_px - 1, 9), np.linspace(0, camera.height_px - 1, 7))
        px = np.column_stack([x.ravel(), y.ravel()])
        c = photo.camera
        ideal = c.undistort((px - c.principal_px) / c.focal_px) * c.focal_px + c.principal_px
        q = np.column_stack([ideal, np.ones(len(ideal))]) @ np.array(placement.H_mosaic_photo).T
        xy = q[:, :2] / q[:, 2:] * gsd_m * [1, -1] + mosaic.origin_uv_m
        found.append(xy @ [1, 1j])
        real.append(plane_points(camera, pose, px) @ [1, 1j])
        pixel_m = camera.gsd_mm_px(-pose.position_m[1]) / 1000.0
    z, w = np.concatenate(found), np.concatenate(real)
    if gauge:
        columns = np.column_stack([z, np.ones(len(z))])
        z = columns @ np.linalg.lstsq(columns, w, rcond=None)[0]
    return np.asarray(np.abs(z - w) / pixel_m)
