"""Stages: check and understand each photo; find its features."""

from collections.abc import Sequence
from pathlib import Path
from typing import Literal

import cv2
import numpy as np
import numpy.typing as npt
from PIL import Image

from artifacts import store
from schemas.arrival import Arrival
from schemas.assigned_shot import AssignedShot
from schemas.calibration import Calibration
from schemas.camera import Camera, CameraPose
from schemas.contract import Vector3
from schemas.file import File, FolderEntry
from schemas.flight_log import FlightLog
from schemas.flight_plan import FlightPlan
from schemas.photo import Features, Photo
from schemas.problem import BadInput
from schemas.settings import StitchSettings
from tasks.heap import reused
from tasks.stage import stage

Charuco = tuple[tuple[int, int], str, float]  # squares across and down, dictionary, marker over square


@stage()
def ingest(
    file: File,
    name: str,
    surface: str,
    camera: Camera | None,
    pose: CameraPose | None,
    position_sigma_m: float,
    velocity_m_s: Vector3 | None = None,
) -> Photo:
    """Decode, set upright, measure; camera from EXIF where none is given. Raises BadInput by name."""
    from tasks.photos.intrinsics import camera_from_metadata, camera_of_photo
    from tasks.photos.metadata import read_metadata
    from tasks.photos.quality import clipped, exposure, sharpness
    from tasks.photos.reading import read_photo

    with reused():
        decoded = read_photo(store.current().path(file), name)
        white, black = clipped(decoded.pixels)
        sharp, along = sharpness(decoded.pixels)
    height_px, width_px = decoded.pixels.shape[:2]
    metadata = read_metadata(decoded.exif, decoded.xmp)
    if camera is None:
        camera, camera_from, focal_sigma = camera_from_metadata(width_px, height_px, metadata)
    else:
        camera = camera_of_photo(camera, width_px, height_px, decoded.orientation, name)
        camera_from, focal_sigma = "inspection", 0.01
    if not decoded.as_it_came:
        with store.current().scratch() as folder:
            Image.fromarray(decoded.pixels).save(folder / "upright.png", compress_level=3)
            file = store.current().put(folder / "upright.png")
    return Photo(
        name=name,
        file=file,
        camera=camera,
        camera_from=camera_from,
        focal_sigma=focal_sigma,
        pose=pose,
        position_sigma_m=position_sigma_m,
        gps=metadata.gps,
        view_deg=metadata.view_deg,
        velocity_m_s=velocity_m_s or metadata.velocity_m_s,
        surface=surface,
        sharpness=sharp,
        sharpness_along=along,
        exposure=exposure(decoded.pixels),
        orientation=decoded.orientation,
        white=white,
        black=black,
        metered_ev=metadata.metered_ev,
    )


def is_mosaic(file: File) -> bool:
    """Whether it is a TIFF with a place on a map, blank parts, or more pixels than photos have. No stage:
    only the command line asks for it."""
    from artifacts.geotiff import told_by
    from tasks.photos.reading import LARGEST_PHOTO_PX, LARGEST_PX

    told = told_by(store.current().path(file))
    if told is None:
        return False
    large = (
        max(told.width_px, told.height_px) > LARGEST_PX or told.width_px * told.height_px > LARGEST_PHOTO_PX
    )
    return large or told.placed or told.transparent or told.nodata is not None


@stage()
def assign(photos: tuple[FolderEntry, ...], log: FlightLog) -> tuple[AssignedShot, ...]:
    """Which photo of all folders of a flight is which shot of its log."""
    from tasks.photos.assignment import assign_shots

    return assign_shots({photo.name: _taken_s(photo) for photo in photos}, log)


def _taken_s(photo: FolderEntry) -> float | None:
    """None where the photo does not tell, as one that is damaged: `ingest` names it."""
    from tasks.photos.metadata import taken_s
    from tasks.photos.reading import read_exif

    try:
        return taken_s(read_exif(store.current().path(photo.file), photo.name))
    except BadInput:
        return None


@stage()
def features(photo: Photo, settings: StitchSettings) -> Features:
    """At most `settings.features` RootSIFT features."""
    from tasks.photos.reading import REMEDY
    from tasks.photos.sift import detect_features, write_features

    path = store.current().path(photo.file)
    with reused():
        grey = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE | cv2.IMREAD_IGNORE_ORIENTATION)
        if grey is None:
            raise BadInput(photo.name, "cannot be read", REMEDY)
        keypoints = detect_features(np.asarray(grey, np.uint8), photo.camera, settings.features)
    with store.current().scratch() as folder:
        write_features(keypoints, folder / "features.npz")
        entered = store.current().put(folder / "features.npz")
    return Features(photo=photo.name, file=entered, count=len(keypoints.xy))


def calibrate(
    paths: Sequence[Path], lens: Literal["brown", "fisheye"], charuco: Charuco | None
) -> tuple[Calibration, npt.NDArray[np.uint8]]:
    """The camera that took these photos of a board, and a picture of what it rests on, (H, W, 3) RGB; no
    stage: only the command line asks for it. charuco: None for a chessboard."""
    from tasks.photos.boards import charuco_finder, find_chessboards
    from tasks.photos.calibrate import calibrate as calibrated
    from tasks.photos.picture import draw_calibration

    find = find_chessboards if charuco is None else charuco_finder(*charuco)
    made = calibrated([(path.name, path) for path in paths], find, lens)
    return made, draw_calibration(made)


def fit_alone(photos: Sequence[Photo], first: dict[str, str] | None = None) -> tuple[Photo | BadInput, ...]:
    """Of photos that stand for themselves, each or why it is not inspected; no stage: it takes no time.
    first: as there."""
    from tasks.photos.alone import fit_alone as fit

    return fit(photos, first)


def judge(photos: Sequence[Photo], plan: FlightPlan | None) -> tuple[tuple[Arrival, ...], tuple[str, ...]]:
    """What each photo so far is good for, and the plan's shooting points that have no good photo yet; no
    stage: it is asked while photos arrive."""
    from tasks.photos.arrival import judged, missing

    arrivals = judged(photos, plan)
    return arrivals, missing(arrivals, plan) if plan else ()
