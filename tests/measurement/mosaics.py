"""Mosaics on disk from drawn images, as the stitching stage hands them on."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import tifffile

from artifacts.store import Store
from schemas.camera import Camera
from schemas.file import File
from schemas.mosaic import Mosaic, PhotoPlacement
from schemas.photo import Photo
from schemas.plane import Plane
from schemas.surface import Surface


def wall(width_m: float, height_m: float) -> Surface:
    """A wall that faces south: u east, v up, its upper left corner at (u, v) = (0, 0), 5 m above ground."""
    ring = ((0.0, -height_m), (width_m, -height_m), (width_m, 0.0), (0.0, 0.0))
    return Surface(
        name="wall",
        plane=Plane.through((2.0, 3.0, 5.0), (0.0, -1.0, 0.0)),
        origin_m=(2.0, 3.0, 5.0),
        u=(1.0, 0.0, 0.0),
        v=(0.0, 0.0, 1.0),
        outline_m=ring,
        hull_m=ring,
        area_m2=width_m * height_m,
    )


def mosaic_of(
    files: Store,
    rgb: npt.NDArray[np.uint8],
    gsd_mm_px: float | None,
    surface: Surface | None = None,
    coverage: npt.NDArray[np.bool_] | None = None,
) -> Mosaic:
    height, width = rgb.shape[:2]
    covered = np.ones((height, width), dtype=bool) if coverage is None else coverage

    def tiled(folder: Path) -> Callable[..., File]:
        def write(pixels: npt.NDArray[Any], name: str, **how: Any) -> File:
            tifffile.imwrite(folder / name, pixels, tile=(128, 128), compression="zlib", **how)
            return files.put(folder / name)

        return write

    with files.scratch() as folder:
        write = tiled(folder)
        image = write(rgb, "image.tif", photometric="rgb")
        photo = Photo(
            name="a.jpg",
            file=image,
            camera=Camera(width_px=width, height_px=height, focal_px=4000.0),
            surface="wall",
            sharpness=1.0,
            exposure=0.5,
        )
        return Mosaic(
            name="wall",
            surface=surface,
            image=image,
            coverage=write(covered.astype(np.uint8) * 255, "coverage.tif"),
            source=write(covered.astype(np.uint16), "source.tif"),
            width_px=width,
            height_px=height,
            gsd_mm_px=gsd_mm_px,
            scale_from="none" if gsd_mm_px is None else "stated GSD",
            origin_uv_m=(0.0, 0.0),
            photos=(photo,),
            placements=(PhotoPlacement(name="a.jpg", status="solved"),),
            covered_m2=None,
            rms_px=None,
        )
