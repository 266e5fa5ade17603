"""Stage: a registered model's surfaces and obstacles."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from artifacts import store
from artifacts.page import Page
from artifacts.picture import markdown_of
from schemas.registered_model import RegisteredModel
from schemas.settings import SurfaceSettings
from schemas.structure import Structure
from tasks.stage import progress, stage


def pages(inputs: Mapping[str, Any], structure: Structure) -> list[Page]:
    from tasks.surfaces.picture import draw_structure

    title = f"### {len(structure.surfaces)} surfaces, {len(structure.obstacles)} obstacles"
    picture = markdown_of(draw_structure(structure), "surfaces in colour, from above and from below")
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
    return [Page(key="surfaces", markdown=f"{title}\n\n{picture}"), Page(key="surfaces-table", table=rows)]


@stage(pages=pages)
def extract(model: RegisteredModel, settings: SurfaceSettings) -> Structure:
    """Planes with their outlines, obstacles, and every point that a vehicle must not meet."""
    from tasks.surfaces.cloud import read_cloud, write_points
    from tasks.surfaces.extraction import extract_structure
    from tasks.surfaces.scanners import scanners

    shelf = store.current()
    stations_m = np.array([[row[3] for row in station.T_world_scan[:3]] for station in model.stations])
    item = "model of " + ", ".join(station.name for station in model.stations)
    cloud = read_cloud(shelf.path(model.cloud), item, stations_m)
    extraction = extract_structure(cloud, settings, item, progress)
    with shelf.scratch() as folder:
        write_points(folder / "occupied.ply", extraction.occupied_m)
        occupied = shelf.put(folder / "occupied.ply")
    return Structure(
        surfaces=extraction.surfaces,
        obstacles=extraction.obstacles,
        occupied=occupied,
        min_m=model.min_m,
        max_m=model.max_m,
        stations_m=tuple((float(e), float(n), float(u)) for e, n, u in scanners(cloud, stations_m)),
        left_out=model.left_out,
    )
