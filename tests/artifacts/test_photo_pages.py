"""What the report shows of a mosaic's photos: their graph, how well they lie, and each one's fate."""

import base64
import io
import re
from pathlib import Path

import numpy as np
import pytest
import tifffile
from PIL import Image

from artifacts.match_graph import FALSE, edge_picture, match_graph
from artifacts.mosaic_view import MosaicView
from artifacts.photo_pages import photo_pages
from artifacts.uncertainty_map import STATED_ALONE, sigma_mm, uncertainty_map
from schemas.mosaic import MatchEdge, Mosaic
from tests.artifacts.bridge import CAMERA, Shelf
from tests.artifacts.inspected import mosaic_of

HOSTILE = "<b>photo</b> & \x07.jpg"


@pytest.fixture
def shelf(tmp_path: Path) -> Shelf:
    (tmp_path / "shelf").mkdir()
    return Shelf(tmp_path / "shelf")


@pytest.fixture
def mosaic(shelf: Shelf) -> Mosaic:
    """800 × 600 px: photo 0 on the left half, 1 on the right, 2 placed alone below, 3 rejected."""
    plain, *_ = mosaic_of(shelf, "wall", None, [], 0, 2.0)
    photo = plain.photos[0]
    names = (HOSTILE, "b.jpg", "c.jpg", "d.jpg")
    middle = np.array([(CAMERA.width_px - 1) / 2, (CAMERA.height_px - 1) / 2])
    placements = []
    for name, status, at, covariance in zip(
        names,
        ("solved", "solved", "placed", "rejected"),
        ((200, 200), (600, 200), (400, 500), None),
        (((0.04, 0.0), (0.0, 0.01)), ((0.25, 0.0), (0.0, 0.16)), None, None),
        strict=True,
    ):
        x, y = (0.0, 0.0) if at is None else np.array(at) - middle
        placements.append(
            plain.placements[0].model_copy(
                update={
                    "name": name,
                    "status": status,
                    "reason": "blurred" if status == "rejected" else "",
                    "H_mosaic_photo": ((1.0, 0.0, x), (0.0, 1.0, y), (0.0, 0.0, 1.0)) if at else None,
                    "covariance_mm2": covariance,
                }
            )
        )
    source = np.ones((600, 800), np.uint16)
    source[:, 400:], source[450:] = 2, 3
    tifffile.imwrite(shelf.folder / "source.tif", source, tile=(256, 256))
    return plain.model_copy(
        update={
            "photos": tuple(photo.model_copy(update={"name": name}) for name in names),
            "placements": tuple(placements),
            "edges": (
                MatchEdge(photos=(0, 1), matches=90, held=True),
                MatchEdge(photos=(0, 2), matches=12, held=False),
                MatchEdge(photos=(1, 3), matches=15, held=False),
            ),
            "source": shelf.put(shelf.folder / "source.tif"),
        }
    )


def test_the_graph_joins_photos_at_their_places(shelf: Shelf, mosaic: Mosaic) -> None:
    with MosaicView(mosaic, shelf.open_file) as view:
        drawn = str(match_graph(view))
    lines = re.findall(
        r'<line x1="([\d.]+)" y1="([\d.]+)" x2="([\d.]+)" y2="([\d.]+)" stroke="(#\w+)"', drawn
    )
    scale = 560 / 600
    held, false = lines  # that to the rejected photo cannot be drawn
    assert [float(v) for v in held[:4]] == pytest.approx(
        [200 * scale, 200 * scale, 600 * scale, 200 * scale], abs=0.01
    )
    assert false[4] == FALSE
    assert held[4] != FALSE
    assert "90 matches" in drawn
    assert "12 matches, disagrees" in drawn
    assert "<b>photo" not in drawn


def test_the_map_shows_the_uncertainty_of_the_photo_under_each_place(shelf: Shelf, mosaic: Mosaic) -> None:
    assert [sigma_mm(p) for p in mosaic.placements] == [pytest.approx(0.2), pytest.approx(0.5), None, None]
    drawn = str(uncertainty_map(mosaic, shelf.open_file))
    assert "0.2 mm" in drawn
    assert "0.5 mm (1σ)" in drawn
    picture = re.search(r"base64,([^\"]+)", drawn)
    assert picture is not None
    with Image.open(io.BytesIO(base64.b64decode(picture.group(1)))) as image:
        pixels = np.asarray(image.convert("RGB"))
    height, width = pixels.shape[:2]
    left, right = pixels[height // 4, width // 4], pixels[height // 4, 3 * width // 4]
    assert tuple(left) == (68, 1, 84)  # viridis from dark,
    assert tuple(right) == (253, 231, 37)  # to bright
    assert "#{:02x}{:02x}{:02x}".format(*pixels[-3, width // 2]) == STATED_ALONE


def test_unknown_heights_count_the_more_the_more_obliquely_a_photo_looks(
    shelf: Shelf, mosaic: Mosaic
) -> None:
    """Cameras 1000 px before the middle: in the upper corners, 500 px aside, 1 cm of height moves 5 mm."""
    gsd_m, (u, v) = (mosaic.gsd_mm_px or 0.0) / 1000.0, mosaic.origin_uv_m
    at = (u + 400 * gsd_m, v - 300 * gsd_m, 1000 * gsd_m)
    seen = tuple(p.model_copy(update={"camera_uvw_m": at}) for p in mosaic.placements)
    update = {"placements": seen, "height_sigma_m": 0.01}
    drawn = str(uncertainty_map(mosaic.model_copy(update=update), shelf.open_file))
    assert "5 mm (1σ)" in drawn
    assert "0.2 mm" in drawn


def test_without_a_scale_no_uncertainty_is_drawn(shelf: Shelf, mosaic: Mosaic) -> None:
    bare = tuple(p.model_copy(update={"covariance_mm2": None}) for p in mosaic.placements)
    assert uncertainty_map(mosaic.model_copy(update={"placements": bare}), shelf.open_file) is None


def test_each_photo_has_a_row_with_its_thumbnail(shelf: Shelf, mosaic: Mosaic) -> None:
    with MosaicView(mosaic, shelf.open_file) as view:
        pages = photo_pages(view, shelf.open_file)
    assert [row.status for row in pages.rows] == ["solved", "solved", "placed", "rejected"]
    assert pages.rows[3].reason == "blurred"
    assert pages.rows[1].sigma_mm == pytest.approx(0.5)
    assert all(row.thumbnail and row.thumbnail.startswith("data:image/jpeg") for row in pages.rows)
    assert pages.false_edges == 2
    assert pages.open


def test_the_dashboards_picture_has_the_same_edges(mosaic: Mosaic) -> None:
    drawn = edge_picture(mosaic, np.full((300, 400, 3), 200, np.uint8), 0.5)
    assert tuple(drawn[100, 200]) == (8, 81, 156)  # half way between photos 0 and 1
    assert tuple(drawn[175, 150]) == (215, 48, 31)  # and 0 and 2
