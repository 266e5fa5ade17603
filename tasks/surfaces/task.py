"""Stage: a registered model's surfaces and obstacles."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from artifacts import store
from artifacts.page import Page
from artifacts.picture import markdown_of
from artifacts.relief_picture import relief_page
from schemas.contract import Vector3
from schemas.raster import Pixels
from schemas.registered_model import RegisteredModel
from schemas.relief import Relief
from schemas.settings import SurfaceSettings
from schemas.structure import Structure
from schemas.surface import Surface
from tasks.stage import progress, stage


def pages(inputs: Mapping[str, Any], structure: Structure) -> list[Page]:
    title = f"### {len(structure.surfaces)} surfaces, {len(structure.obstacles)} obstacles"
    drawn = markdown_of(picture(structure), "surfaces in colour, from above and from below")
    rows = [
        {
            "surface": surface.name,
            "area_m2": round(surface.area_m2, 2),
            "width_m": round(surface.bounds_m[2], 2),
            "height_m": round(surface.bounds_m[3], 2),
            "faces": ", ".join(f"{axis:+.2f}" for axis in surface.plane.normal),
            "rms_mm": round(1000 * surface.rms_m, 1),
            "points": surface.points,
        }
        for surface in structure.surfaces
    ]
    return [Page(key="surfaces", markdown=f"{title}\n\n{drawn}"), Page(key="surfaces-table", table=rows)]


def picture(structure: Structure) -> Pixels:
    """(H, W, 3) RGB of the surfaces in colour with their names, and the obstacles."""
    from tasks.surfaces.picture import draw_structure

    return draw_structure(structure)


@stage(pages=pages)
def extract(model: RegisteredModel, settings: SurfaceSettings) -> Structure:
    """Planes with their outlines, obstacles, and every point that a vehicle must not meet."""
    from tasks.surfaces.cloud import read_cloud, write_points
    from tasks.surfaces.extraction import extract_structure
    from tasks.surfaces.scanners import scanners

    shelf = store.current()
    unknown = (np.nan, np.nan, np.nan)
    scanners_m = np.array([station.scanner_m or unknown for station in model.stations])
    item = "model of " + ", ".join(station.name for station in model.stations)
    cloud = read_cloud(shelf.path(model.cloud), item, scanners_m)
    extraction = extract_structure(cloud, settings, item, progress)
    stations_m, windows = scanners(cloud, scanners_m)
    with shelf.scratch() as folder:
        write_points(folder / "occupied.ply", extraction.occupied_m)
        occupied = shelf.put(folder / "occupied.ply")
    return Structure(
        surfaces=extraction.surfaces,
        obstacles=extraction.obstacles,
        occupied=occupied,
        min_m=_triple(cloud.points.min(axis=0)),
        max_m=_triple(cloud.points.max(axis=0)),
        stations_m=tuple(_triple(place_m) for place_m in stations_m),
        windows=windows,
        world_origin_m=model.origin_m,
        utm_zone=model.utm_zone,
        left_out=model.left_out,
    )


def _triple(place_m: npt.NDArray[np.float64]) -> Vector3:
    east, north, up = place_m.tolist()
    return east, north, up


def relief_pages(inputs: Mapping[str, Any], reliefs: tuple[Relief, ...]) -> list[Page]:
    return [relief_page(relief) for relief in reliefs]


@stage(pages=relief_pages)
def measure_relief(model: RegisteredModel, surfaces: tuple[Surface, ...]) -> tuple[Relief, ...]:
    """How surfaces stand out of their planes; none of those that are flat within the scans' noise."""
    from tasks.surfaces.cloud import on_surface, read_table
    from tasks.surfaces.relief import heights_of

    shelf, reliefs = store.current(), []
    table = read_table(shelf.path(model.cloud), "the registered model")
    for done, surface in enumerate(surfaces, start=1):
        found = heights_of(on_surface(table, surface), surface.bounds_m)
        if found is not None:
            with shelf.scratch() as folder:
                np.save(folder / "heights.npy", found.w_m.astype(np.float32))
                heights = shelf.put(folder / "heights.npy")
            reliefs.append(
                Relief(
                    surface=surface.name,
                    heights=heights,
                    left_m=found.left_m,
                    bottom_m=found.bottom_m,
                    cell_m=found.cell_m,
                    rms_m=float(np.sqrt(np.mean(found.w_m**2))),
                    sigma_m=found.sigma_m,
                )
            )
        progress(done / len(surfaces))
    return tuple(reliefs)
