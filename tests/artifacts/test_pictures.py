"""Pictures show what is there: hidden things hidden, thin things in sight, sizes to scale."""

from itertools import pairwise
from pathlib import Path

import cv2
import numpy as np
import pytest
import tifffile
from hypothesis import given, settings
from hypothesis import strategies as st

from artifacts import palette
from artifacts.atlas import flat
from artifacts.close_up import widest_place, window_about
from artifacts.cloud_sample import cloud_sample
from artifacts.data_uri import jpeg
from artifacts.mosaic_view import HATCH, MosaicView, Window, reduced_mask
from artifacts.orthographic import Canvas, View
from artifacts.surface_sheet import simplified, strips, ticks
from artifacts.view3d import Scene, cloud_picture, has_underside, nice_length, picture
from schemas.bit_mask import BitMask
from schemas.crack import WidthSample
from schemas.problem import BadInput
from tests.artifacts.bridge import write_ply
from tests.artifacts.inspected import Inspected

SQUARE = np.array([(-1.0, 0.0, -1.0), (1.0, 0.0, -1.0), (1.0, 0.0, 1.0), (-1.0, 0.0, 1.0)])  # faces south
BEHIND = SQUARE + np.array([0.0, 2.0, 0.0])
RED, BLUE = (200, 0, 0), (0, 0, 200)


def from_south(width_px: int = 400, height_px: int = 400) -> View:
    return View(3 * SQUARE, 180.0, 0.0, width_px, height_px)


def decoded(png: bytes) -> np.ndarray:
    return cv2.imdecode(np.frombuffer(png, np.uint8), cv2.IMREAD_COLOR)[..., ::-1]


# -- the view -------------------------------------------------------------------------------------------


def test_seen_from_the_south_east_is_right_and_up_is_up() -> None:
    view = from_south()
    middle, east, up, north = view.project([(0, 0, 0), (1, 0, 0), (0, 0, 1), (0, 1, 0)])
    assert east[0] - middle[0] == pytest.approx(view.px_per_m)
    assert up[1] - middle[1] == pytest.approx(-view.px_per_m)
    assert north[:2] == pytest.approx(middle[:2]) and north[2] - middle[2] == pytest.approx(1.0)


@given(st.floats(0, 360), st.floats(-80, 80), st.integers(0, 1000))
@settings(max_examples=60)
def test_everything_fits_in_the_picture(azimuth_deg: float, elevation_deg: float, seed: int) -> None:
    points = np.random.default_rng(seed).normal(0, (20, 5, 3), (30, 3))
    seen = View(points, azimuth_deg, elevation_deg, 300, 200).project(points)
    assert seen[:, 0].min() >= 0 and seen[:, 0].max() <= 300
    assert seen[:, 1].min() >= 0 and seen[:, 1].max() <= 200


@pytest.mark.parametrize("order", [(0, 1), (1, 0)])
def test_the_nearer_of_two_walls_hides_the_other_whatever_is_drawn_first(order: tuple[int, int]) -> None:
    walls = [(SQUARE, RED), (BEHIND, BLUE)]
    canvas = Canvas(from_south())
    for index in order:
        canvas.polygon([walls[index][0]], walls[index][1])
    assert tuple(canvas.pixels[200, 200]) == RED


def test_two_crossing_walls_hide_each_other_by_halves() -> None:
    turn = np.radians(30)
    slanted = SQUARE @ np.array(
        [[np.cos(turn), np.sin(turn), 0], [-np.sin(turn), np.cos(turn), 0], [0, 0, 1]]
    )
    canvas = Canvas(from_south())
    canvas.polygon([SQUARE], RED)
    canvas.polygon([slanted], BLUE)
    left, right = tuple(canvas.pixels[200, 170]), tuple(canvas.pixels[200, 230])
    assert {left, right} == {RED, BLUE}


def test_a_hole_shows_what_is_behind_and_an_edge_on_wall_shows_nothing() -> None:
    canvas = Canvas(from_south())
    canvas.polygon([BEHIND], BLUE)
    canvas.polygon([SQUARE, 0.5 * SQUARE], RED)
    canvas.polygon([SQUARE[:, [1, 0, 2]]], (0, 255, 0))
    assert tuple(canvas.pixels[200, 200]) == BLUE
    assert tuple(canvas.pixels[200, 200 + round(0.75 * canvas.view.px_per_m)]) == RED


def test_a_line_behind_a_wall_shows_through_faintly_and_one_on_it_fully() -> None:
    canvas = Canvas(from_south())
    canvas.polygon([SQUARE], (255, 255, 255))
    canvas.line([(-2, 1, 0.5), (2, 1, 0.5)], "#000000", 1)
    canvas.line([(-2, 0.01, -0.5), (2, 0.01, -0.5)], "#000000", 1)
    offset = round(0.5 * canvas.view.px_per_m)
    assert 100 < canvas.pixels[200 - offset, 200, 0] < 220
    assert canvas.pixels[200 + offset, 200, 0] == 0


def test_of_a_cloud_the_nearest_point_is_seen() -> None:
    canvas = Canvas(from_south())
    colours = np.array([RED, BLUE], dtype=np.uint8)
    canvas.points([(0, 1, 0), (0, -1, 0)], colours)
    assert tuple(canvas.pixels[200, 200]) == BLUE


# -- the scene ------------------------------------------------------------------------------------------


def test_scene_shows_paths_cracks_and_surfaces_in_their_colours(bridge: Inspected) -> None:
    drawn = decoded(picture(Scene(bridge.structure, bridge.plan, bridge.log, bridge.report.cracks), 900, 540))
    assert drawn.shape == (540, 900, 3)
    for colour in (palette.PLANNED, palette.FLOWN, palette.SEVERITY["wide"]):
        close = np.abs(drawn.astype(int) - palette.rgb(colour)).max(axis=2) < 40
        assert close[:490].sum() > 30, colour


def test_a_soffit_is_seen_from_below_only(bridge: Inspected) -> None:
    assert bridge.structure is not None
    cracks = [crack for crack in bridge.report.cracks if crack.surface == "soffit-01"]
    scene = Scene(bridge.structure, cracks=cracks, colours={})
    assert has_underside(scene)
    fine = palette.rgb(palette.SEVERITY["fine"])
    seen = [
        int(
            (
                np.abs(decoded(picture(scene, 900, 540, from_below=b))[:490].astype(int) - fine).max(axis=2)
                < 12
            ).sum()
        )
        for b in (False, True)
    ]
    assert seen[1] > 50 > 3 * seen[0]


def test_an_empty_scene_is_an_empty_picture() -> None:
    assert decoded(picture(Scene(), 400, 300)).shape == (300, 400, 3)
    assert decoded(cloud_picture(np.zeros((0, 3)), np.zeros(0, int), [], (), 400, 300)).shape == (300, 400, 3)


def test_a_name_with_mathematics_in_it_is_only_a_name(bridge: Inspected) -> None:
    assert bridge.structure is not None
    odd = bridge.structure.surfaces[1].model_copy(update={"name": r"$\frac{1}{$ <b>\n"})
    built = bridge.structure.model_copy(update={"surfaces": (odd,)})
    assert decoded(picture(Scene(built), 400, 300)).shape == (300, 400, 3)


def test_cloud_sample_reads_what_registration_writes(tmp_path: Path) -> None:
    points = np.random.default_rng(0).normal(0, 10, (1000, 3))
    write_ply(tmp_path / "model.ply", points, np.arange(1000) % 7)
    read, stations = cloud_sample(tmp_path / "model.ply")
    np.testing.assert_allclose(read, points, atol=1e-5)
    assert list(stations) == [i % 7 for i in range(1000)]
    (tmp_path / "no.ply").write_text("hello")
    with pytest.raises(BadInput, match="cannot be read"):
        cloud_sample(tmp_path / "no.ply")


# -- mosaics --------------------------------------------------------------------------------------------


def test_window_at_full_size_is_the_mosaic_and_blank_is_hatched(bridge: Inspected) -> None:
    mosaic, *_ = bridge.seen[0]
    with MosaicView(mosaic, bridge.shelf.open_file) as view:
        window = Window(300, 50, 700, 200)
        drawn = view.picture(window, (400, 150))
        corner = Window(mosaic.width_px - 50, 0, mosaic.width_px, 50)
        blank = view.picture(corner, (50, 50))
    image = tifffile.imread(bridge.shelf.open_file(mosaic.image))
    np.testing.assert_array_equal(drawn, image[50:200, 300:700])
    assert {tuple(int(c) for c in pixel) for pixel in blank.reshape(-1, 3)} == set(HATCH)


@pytest.mark.parametrize("size", [(600, 45), (311, 23), (90, 7), (1, 1)])
def test_reduction_keeps_the_mean_and_the_place(bridge: Inspected, size: tuple[int, int]) -> None:
    mosaic, *_ = bridge.seen[2]
    image = tifffile.imread(bridge.shelf.open_file(mosaic.image)).astype(float)
    window = Window(0, 120, 2200, 300)  # nothing blank in it
    with MosaicView(mosaic, bridge.shelf.open_file) as view:
        drawn = view.picture(window, size)
    expected = cv2.resize(image[120:300, :2200], size, interpolation=cv2.INTER_AREA)
    assert drawn.shape == (size[1], size[0], 3)
    assert np.abs(drawn - expected).mean() < 2.5
    assert abs(drawn.mean() - expected.mean()) < 1.0


@given(st.integers(1, 400), st.integers(1, 400), st.integers(1, 80), st.integers(1, 80), st.integers(0, 99))
@settings(max_examples=60)
def test_a_single_mask_pixel_is_never_lost(height: int, width: int, h: int, w: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    mask = np.zeros((height, width), bool)
    y, x = rng.integers(height), rng.integers(width)
    mask[y, x] = True
    small = reduced_mask(BitMask.of(mask), Window(0, 0, width, height), (w, h))
    assert small.sum() == 1
    found_y, found_x = np.argwhere(small)[0]
    assert abs((found_y + 0.5) / small.shape[0] - (y + 0.5) / height) <= 1 / small.shape[0]
    assert abs((found_x + 0.5) / small.shape[1] - (x + 0.5) / width) <= 1 / small.shape[1]


@given(st.integers(20, 40_000), st.integers(20, 40_000))
def test_strips_cover_the_mosaic_once(width_px: int, height_px: int) -> None:
    cut = strips(Window(0, 0, width_px, height_px))
    assert sum(w.width_px * w.height_px for w in cut) == width_px * height_px
    assert all(a.x1 == b.x0 or a.y1 == b.y0 for a, b in pairwise(cut))


@given(
    st.lists(st.tuples(st.floats(-500, 500), st.floats(-500, 500)), min_size=2, max_size=40),
    st.floats(0.1, 20),
)
def test_a_simplified_line_stays_within_its_tolerance(
    line: list[tuple[float, float]], tolerance: float
) -> None:
    kept = simplified(line, tolerance)
    assert tuple(kept[0]) == line[0] and tuple(kept[-1]) == line[-1]
    for point in np.array(line):
        nearest = min(_distance(point, a, b) for a, b in pairwise(kept))
        assert nearest <= tolerance + 1e-6


def _distance(point: np.ndarray, a: np.ndarray, b: np.ndarray) -> float:
    along = b - a
    t = np.clip((point - a) @ along / max(along @ along, 1e-12), 0, 1)
    return float(np.linalg.norm(point - a - t * along))


@given(st.floats(1e-4, 1e6))
def test_scale_bars_have_round_lengths(about: float) -> None:
    length = nice_length(about)
    assert about / 2.5 <= length * (1 + 1e-9) and length <= about * (1 + 1e-9)
    assert f"{length:.0e}"[0] in "125"


def test_ticks_lie_inside_and_zero_has_no_sign() -> None:
    assert ticks(-0.45, 0.45, 0.2) == [-0.4, -0.2, 0.0, 0.2, 0.4]
    assert str(ticks(-0.1, 0.1, 0.1)[1]) == "0.0"


def test_the_close_up_holds_the_widest_place_at_its_true_scale(bridge: Inspected) -> None:
    mosaic, *_ = bridge.seen[0]
    for crack in bridge.seen[0][3].cracks:
        window = window_about(crack, Window(0, 0, mosaic.width_px, mosaic.height_px), 75)
        place, direction = widest_place(crack)
        assert (window.width_px, window.height_px) == (75, 75)
        assert window.x0 <= place[0] < window.x1 and window.y0 <= place[1] < window.y1
        assert np.hypot(*direction) == pytest.approx(1.0)


def test_the_widest_place_is_told_along_the_whole_crack(bridge: Inspected) -> None:
    """The last width lies before the crack's end: 30 of 34 mm along is 30 px of 34, not the end."""
    widths = tuple(WidthSample(s_mm=s, width_mm=w, sigma_mm=0.1) for s, w in ((0, 1), (10, 2), (30, 5)))
    line = ((0.0, 0.0), (34.0, 0.0))
    told = {"polyline_px": line, "widths": widths, "length_mm": 34.0, "width_max_mm": 5.0}
    place, _ = widest_place(bridge.seen[0][3].cracks[0].model_copy(update=told))
    assert place == pytest.approx([30.0, 0.0])


def test_a_crack_lies_flat_where_its_surface_says(bridge: Inspected) -> None:
    mosaic, *_, measured = bridge.seen[1]
    laid = flat(mosaic, measured.cracks)
    assert laid is not None and mosaic.surface is not None
    for crack, line in laid.cracks:
        expected = mosaic.surface.to_surface(crack.polyline_world_m)[:, :2]
        np.testing.assert_allclose(line, expected, atol=1e-6)


@given(st.integers(0, 50), st.integers(100, 600), st.integers(4_000, 60_000))
@settings(max_examples=15)
def test_a_picture_keeps_its_size_bound_even_of_noise(seed: int, side: int, max_bytes: int) -> None:
    noise = np.random.default_rng(seed).integers(0, 255, (side, side, 3), dtype=np.uint8)
    content = jpeg(noise, max_bytes)
    shape = cv2.imdecode(np.frombuffer(content, np.uint8), cv2.IMREAD_COLOR).shape
    assert len(content) <= max_bytes or max(shape) < 120
