"""The stage on a stored structure, and what it shows."""

import base64
from pathlib import Path

import cv2
import numpy as np
import open3d as o3d
import pytest

from artifacts import store
from schemas.problem import BadInput
from schemas.settings import PlanSettings
from schemas.structure import Structure
from tasks.planning.occupied_points import read_points
from tasks.planning.task import pages, plan_flight, width_maps
from tests.planning.structures import CAMERA, OPEN, ORIGIN, VEHICLE, wall


def stored(structure: Structure, points: np.ndarray) -> Structure:
    with store.current().scratch() as folder:
        cloud = o3d.t.geometry.PointCloud(o3d.core.Tensor(points.astype(np.float32)))
        o3d.t.io.write_point_cloud(str(folder / "occupied.ply"), cloud)
        occupied = store.current().put(folder / "occupied.ply")
    return structure.model_copy(update={"occupied": occupied})


def test_the_stage_plans_from_the_store_and_draws_it() -> None:
    world = wall()
    with store.temporary():
        structure = stored(world.structure, world.cloud)
        made = plan_flight.bare(
            structure, CAMERA, VEHICLE, ORIGIN, None, PlanSettings(gsd_mm_px=1.0, free_m=(OPEN,))
        )
        assert made.coverage[0].covered >= 0.995
        (widths,) = width_maps(made).values()
        assert np.isfinite(widths).mean() > 0.97  # all of the wall but half a row of squares
        assert np.nanmax(widths) <= 3.0 * 1.02  # three pixels of 1 mm
        assert np.nanmin(widths) >= 3.0 * made.coverage[0].gsd_mm_px * 0.9
        shown, table = pages({"structure": structure}, made)
    assert len(table.table) == len(made.waypoints)
    picture = base64.b64decode((shown.markdown or "").split("base64,")[1].split(")")[0])
    drawn = cv2.imdecode(np.frombuffer(picture, np.uint8), cv2.IMREAD_COLOR)
    assert drawn.shape[1] > 1000
    assert (drawn.std(axis=2) > 40).sum() > 500  # something coloured is in it


def test_an_empty_or_broken_cloud_is_refused(tmp_path: Path) -> None:
    (tmp_path / "empty.ply").write_bytes(
        b"ply\nformat binary_little_endian 1.0\nelement vertex 0\nend_header\n"
    )
    (tmp_path / "text.ply").write_text("no cloud at all\n")
    for name in ("empty.ply", "text.ply"):
        with pytest.raises(BadInput):
            read_points(tmp_path / name)
