"""Stages: stitch the photos of a surface; let a photo stand for itself."""

from collections.abc import Callable, Iterable, Mapping
from contextlib import closing
from pathlib import Path, PurePath
from typing import TYPE_CHECKING, Any

import cv2
import numpy as np

from artifacts import store
from artifacts.match_graph import edge_picture
from artifacts.mosaic import MosaicWriter
from artifacts.page import Page, page_key
from artifacts.picture import markdown_of, thumbnail
from artifacts.raster import TiffWindows
from artifacts.relief_picture import relief_page
from artifacts.uncertainty_map import sigma_mm
from schemas.contract import Matrix3, Vector2, Vector3
from schemas.control import Control
from schemas.file import File
from schemas.mosaic import MatchEdge, Mosaic, PhotoPlacement
from schemas.photo import Features, Photo
from schemas.problem import BadInput, LeftOut
from schemas.relief import Relief
from schemas.settings import StitchSettings
from schemas.surface import Surface
from tasks.heap import given_back
from tasks.stage import progress, stage

if TYPE_CHECKING:
    from tasks.stitching.compositing import Pixels, Tile
    from tasks.stitching.mosaicking import Registered
    from tasks.stitching.pairs import PhotoFeatures
    from tasks.stitching.relief import HeightMap
    from tasks.stitching.view import Array

POSITIONS = ("poses", "GPS")  # gauges whose error the adjustment tells
REMEDY = {
    "blurred": "Shoot it again, slower or with a shorter exposure",
    "the same": "Nothing to do",
    "overexposed": "Shoot it again with a shorter exposure",
    "underexposed": "Shoot it again with a longer exposure",
}


def pages(inputs: Mapping[str, Any], mosaic: Mosaic) -> list[Page]:
    picture, scale = thumbnail(mosaic)
    graph = edge_picture(mosaic, picture, scale)
    counts = ", ".join(
        f"{sum(p.status == status for p in mosaic.placements)} {status}"
        for status in ("solved", "placed", "rejected")
    )
    text = f"### Mosaic of {mosaic.name}: {counts}; {mosaic.gauge}"
    rows = [
        {
            "photo": p.name,
            "status": p.status,
            "reason": p.reason,
            "matches": p.matches,
            "sigma_mm": None if (sigma := sigma_mm(p)) is None else round(sigma, 3),
            "rms_px": None if p.rms_px is None else round(p.rms_px, 3),
            "gain": round(p.gain, 3),
        }
        for p in mosaic.placements
    ]
    return [
        Page(key=page_key("mosaic", mosaic.name), markdown=f"{text}\n\n{markdown_of(picture, mosaic.name)}"),
        Page(
            key=page_key("match-graph", mosaic.name),
            markdown=f"### Match graph of {mosaic.name}: {len(mosaic.edges)} pairs,"
            f" {sum(not e.held for e in mosaic.edges)} of them false\n\n{markdown_of(graph, mosaic.name)}",
        ),
        Page(key=page_key("photos", mosaic.name), table=rows),
        *([relief_page(own)] if (own := mosaic.relief) and own.measured_by == "photos" else []),
    ]


@stage(pages=pages)
def stitch(
    name: str,
    surface: Surface | None,
    photos: tuple[Photo, ...],
    features: tuple[Features, ...],
    settings: StitchSettings,
    control: Control | None = None,
    relief: Relief | None = None,
) -> Mosaic:
    """One mosaic of all photos of a surface; every photo is solved, placed or rejected with a reason.

    features: of each photo, in their order."""
    from tasks.stitching.mosaicking import blend_photos, register_photos
    from tasks.stitching.sightings import sightings_in

    if not photos:
        raise BadInput(name, "has no photo", "Give it photos, or leave it out")
    given_back()  # what reading the photos left
    described = sorted(zip(photos, features, strict=True), key=lambda pair: pair[0].name)
    ordered = [photo for photo, _ in described]
    found = [_features(of_photo) for _, of_photo in described]
    read = _reader(ordered)
    sightings, not_there = sightings_in(control, ordered, read) if control else ({}, ())
    registered = register_photos(
        name,
        surface,
        ordered,
        found,
        settings,
        lambda f: progress(0.5 * f),
        control,
        sightings,
        _height_map(relief),
    )
    gains, tiles = blend_photos(registered, read, lambda f: progress(0.5 + 0.5 * f))
    canvas, metric = registered.canvas, registered.scale_from != "none"
    placements = tuple(_placement(registered, i, float(gains[i])) for i in range(len(ordered)))
    solved = registered.solved
    on_relief = None
    if solved.relief is not None:  # the scan's, unless the photos told 1σ of one of their own
        on_relief = relief if solved.relief_sigma is None else _own_relief(name, registered, metric)
    squares = [solved.matches[i] * rms**2 for i, rms in solved.rms_px.items()]
    return _written(
        tiles,
        name=name,
        surface=registered.surface,
        width_px=canvas.width_px,
        height_px=canvas.height_px,
        gsd_mm_px=canvas.gsd * 1000.0 if metric else None,
        scale_from=registered.scale_from,
        scale_sigma=solved.sigma_scale if solved.views and registered.scale_from in POSITIONS else None,
        origin_uv_m=(canvas.left, canvas.top) if metric else (0.0, 0.0),
        photos=tuple(_as_adjusted(registered, i) for i in range(len(ordered))),
        placements=placements,
        edges=tuple(
            MatchEdge(photos=(e.a, e.b), matches=len(e.matches), held=(e.a, e.b) in solved.held)
            for e in solved.edges
        ),
        relief=on_relief,
        height_sigma_m=_height_sigma_m(registered.surface, on_relief),
        rms_px=float(np.sqrt(sum(squares) / sum(solved.matches.values()))) if squares else None,
        left_out=tuple(
            LeftOut(item=p.name, stage="stitching", what=p.reason, remedy=_remedy(p.reason))
            for p in placements
            if p.status == "rejected"
        )
        + not_there
        + registered.left_out,
        control=registered.control,
    )


@stage(pages=pages)
def single(photo: Photo, gsd_mm_px: float | None) -> Mosaic:
    """A photo that stands for itself: undistorted, one placement; unaltered where the lens is ideal."""
    from tasks.stitching.undistortion import undistorted_tile

    identity: Matrix3 = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    return _written(
        [undistorted_tile(_reader([photo])(0), photo.camera)],
        name=photo.name,
        surface=None,
        width_px=photo.camera.width_px,
        height_px=photo.camera.height_px,
        gsd_mm_px=gsd_mm_px,
        scale_from="none" if gsd_mm_px is None else "stated GSD",
        origin_uv_m=(0.0, 0.0),
        photos=(photo,),
        placements=(PhotoPlacement(name=photo.name, status="solved", H_mosaic_photo=identity),),
        rms_px=None,
        left_out=(),
    )


def given_mosaic(file: File, name: str, gsd_mm_px: float | None) -> Mosaic:
    """A mosaic that somebody stitched, of any size: a TIFF of 8-bit RGB, blank where it is transparent or of
    the value that its tags name. Its own scale where none is given. Raises BadInput by name; no stage: only
    the command line asks for it."""
    from artifacts.geotiff import told_by
    from tasks.stitching.given import REMEDY, tiles_of

    path = store.current().path(file)
    told = told_by(path)
    own_gsd_mm_px, nodata = (None, None) if told is None else (told.gsd_mm_px, told.nodata)
    scale_from = "the file itself" if own_gsd_mm_px else "none"
    with closing(TiffWindows(path, name, REMEDY)) as windows:
        return _written(
            tiles_of(windows, name, nodata, progress),
            name=PurePath(name).stem,
            surface=None,
            width_px=windows.width_px,
            height_px=windows.height_px,
            gsd_mm_px=gsd_mm_px or own_gsd_mm_px,
            scale_from="stated GSD" if gsd_mm_px else scale_from,
            origin_uv_m=(0.0, 0.0),
            photos=(),
            placements=(),
            rms_px=None,
        )


def _features(features: Features) -> "PhotoFeatures":
    from tasks.stitching.pairs import PhotoFeatures

    with np.load(store.current().path(features.file)) as arrays:
        return PhotoFeatures(arrays["xy"], arrays["scale"], arrays["response"], arrays["descriptors"])


def _height_map(relief: Relief | None) -> "HeightMap | None":
    from tasks.stitching.relief import HeightMap

    if relief is None:
        return None
    heights = np.load(store.current().path(relief.heights)).astype(np.float64)
    return HeightMap(heights, relief.left_m, relief.bottom_m, relief.cell_m)


def _own_relief(name: str, registered: "Registered", metric: bool) -> Relief | None:
    """The one that the photos themselves told; None where nothing is known in metres."""
    heights, sigma = registered.solved.relief, registered.solved.relief_sigma
    if heights is None or sigma is None or not metric:
        return None
    seen = heights.seen_by([view.outline_uv for view in registered.solved.views.values()])
    with store.current().scratch() as folder:
        np.save(folder / "heights.npy", heights.w.astype(np.float32))
        np.save(folder / "sigmas.npy", sigma.w.astype(np.float32))
        return Relief(
            surface=name,
            heights=store.current().put(folder / "heights.npy"),
            sigmas=store.current().put(folder / "sigmas.npy"),
            left_m=heights.left,
            bottom_m=heights.bottom,
            cell_m=heights.cell,
            rms_m=float(np.sqrt(np.mean(heights.w[seen] ** 2))),
            sigma_m=float(np.median(sigma.w[seen])),
            measured_by="photos",
        )


def _height_sigma_m(surface: Surface | None, relief: Relief | None) -> float | None:
    """Of what the photos are laid on: the relief, or the plane, of which 95 % of the points lie within 2σ."""
    if relief is not None:
        return relief.sigma_m
    return None if surface is None else surface.deviation_m / 2


def _reader(photos: list[Photo]) -> Callable[[int], "Pixels"]:

    paths: list[Path] = [store.current().path(p.file) for p in photos]  # verified here, read from threads

    def read(index: int) -> "Pixels":
        rgb = cv2.imread(str(paths[index]), cv2.IMREAD_COLOR_RGB | cv2.IMREAD_IGNORE_ORIENTATION)
        if rgb is None:
            raise BadInput(photos[index].name, "cannot be read", "Copy it again from the camera's card")
        return np.asarray(rgb)

    return read


def _placement(registered: "Registered", index: int, gain: float) -> PhotoPlacement:
    fate, solved = registered.fates[index], registered.solved
    H = None if fate.view is None else _matrix(registered.canvas.H_mosaic_plane @ fate.view.H_plane_photo)
    return PhotoPlacement(
        name=registered.photos[index].name,
        status=fate.status,
        reason=fate.reason,
        H_mosaic_photo=H,
        camera_uvw_m=_camera_uvw_m(registered, index),
        matches=solved.matches.get(index, 0),
        rms_px=solved.rms_px.get(index),
        covariance_mm2=_covariance_mm2(registered, index),
        gain=gain,
    )


def _camera_uvw_m(registered: "Registered", index: int) -> Vector3 | None:
    view = registered.fates[index].view
    if view is None or registered.scale_from == "none":
        return None
    u, v, w = (float(x) for x in view.C)
    return u, v, w


def _covariance_mm2(registered: "Registered", index: int) -> tuple[Vector2, Vector2] | None:
    """None where no scale is known, or no match holds the photo."""
    if registered.scale_from == "none" or index not in registered.solved.covariance:
        return None
    (a, b), (c, d) = registered.solved.covariance[index] * 1e6
    return (float(a), float(b)), (float(c), float(d))


def _matrix(H: "Array") -> Matrix3:
    a, b, c = (tuple(float(x) for x in row) for row in H / H[2, 2])
    return (a[0], a[1], a[2]), (b[0], b[1], b[2]), (c[0], c[1], c[2])


def _as_adjusted(registered: "Registered", index: int) -> Photo:
    view = registered.fates[index].view
    photo = registered.photos[index]
    return photo if view is None else photo.model_copy(update={"camera": view.camera})


def _remedy(reason: str) -> str:
    told = (remedy for begin, remedy in REMEDY.items() if reason.startswith(begin))
    return next(told, "Check that it shows this surface, or shoot it again with more overlap")


def _written(tiles: Iterable["Tile"], **known: Any) -> Mosaic:
    """The mosaic with its three files in the store."""
    with store.current().scratch() as folder:
        frame = f"surface {known['surface'].name}" if known["surface"] else "own plane"
        with MosaicWriter(
            folder, known["width_px"], known["height_px"], known["gsd_mm_px"], known["origin_uv_m"], frame
        ) as writer:
            for tile in tiles:
                writer.put(tile.x, tile.y, tile.rgb, tile.coverage, tile.source)
        gsd_mm_px = known["gsd_mm_px"]
        return Mosaic(
            **known,
            image=store.current().put(writer.image),
            coverage=store.current().put(writer.coverage),
            source=store.current().put(writer.source),
            covered_m2=None if gsd_mm_px is None else writer.covered_px * (gsd_mm_px / 1000.0) ** 2,
        )
