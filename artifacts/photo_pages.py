"""What the report shows of a mosaic's photos: each with its fate, their match graph, how well they lie."""

from dataclasses import dataclass

import cv2
import numpy as np
from markupsafe import Markup

from artifacts.data_uri import jpeg_uri
from artifacts.match_graph import match_graph
from artifacts.mosaic_view import MosaicView, OpenFile
from artifacts.uncertainty_map import sigma_mm, uncertainty_map
from schemas.file import File
from schemas.photo import Photo, sharpness_shares

THUMB_PX = 96
THUMBS_BYTES, THUMB_BYTES = 3_000_000, 4_000  # of all and of each, as files
MOST_OPEN = 40  # rows that the page shows without being asked


@dataclass(frozen=True)
class PhotoRow:
    number: int
    name: str
    thumbnail: str | None  # data URI; None where the file cannot be read any more
    status: str
    reason: str
    matches: int
    rms_px: float | None
    sigma_mm: float | None  # 1σ among the others, along the worst direction
    gain: float
    sharpness: float  # over the median photo's, where that is least
    camera_from: str


@dataclass(frozen=True)
class PhotoPages:
    rows: tuple[PhotoRow, ...]
    graph: Markup
    uncertainty: Markup | None
    false_edges: int
    open: bool


def photo_pages(view: MosaicView, open_file: OpenFile) -> PhotoPages:
    mosaic = view.mosaic
    budget = min(THUMB_BYTES, THUMBS_BYTES // len(mosaic.photos))
    rows = tuple(
        PhotoRow(
            number=number,
            name=placement.name,
            thumbnail=_thumbnail(photo.file, open_file, budget),
            status=placement.status,
            reason=placement.reason,
            matches=placement.matches,
            rms_px=placement.rms_px,
            sigma_mm=sigma_mm(placement),
            gain=placement.gain,
            sharpness=share,
            camera_from=_camera_from(photo),
        )
        for number, (placement, photo, share) in enumerate(
            zip(mosaic.placements, mosaic.photos, sharpness_shares(mosaic.photos), strict=True), start=1
        )
    )
    return PhotoPages(
        rows=rows,
        graph=match_graph(view),
        uncertainty=uncertainty_map(mosaic, open_file),
        false_edges=sum(not edge.held for edge in mosaic.edges),
        open=len(rows) <= MOST_OPEN,
    )


def _camera_from(photo: Photo) -> str:
    return "given" if photo.camera_from == "inspection" else photo.camera_from


def _thumbnail(file: File, open_file: OpenFile, max_bytes: int) -> str | None:
    pixels = cv2.imread(str(open_file(file)), cv2.IMREAD_REDUCED_COLOR_8 | cv2.IMREAD_IGNORE_ORIENTATION)
    if pixels is None:
        return None
    scale = min(1.0, THUMB_PX / max(pixels.shape[:2]))
    size = (max(1, round(pixels.shape[1] * scale)), max(1, round(pixels.shape[0] * scale)))
    small = cv2.resize(pixels, size, interpolation=cv2.INTER_AREA)
    return jpeg_uri(np.asarray(small[..., ::-1], dtype=np.uint8), max_bytes)
