import cv2
import numpy as np
import pytest

from schemas.raster import ArrayRaster
from schemas.settings import PatternSettings
from tasks.patterns.remove import remove
from tests.development_data import development_data

CONCRETE, WOOD = (150, 148, 142), (178, 139, 96)
COLOURS = {
    "pink": (230, 70, 160),
    "red": (200, 30, 40),
    "green": (30, 170, 60),
    "blue": (40, 80, 210),
    "yellow": (235, 215, 40),
}


def surface(colour: tuple[int, int, int], seed: int = 0) -> np.ndarray:
    """Rough, unevenly lit, 600 × 400 px."""
    rng = np.random.default_rng(seed)
    rough = cv2.GaussianBlur(rng.normal(size=(400, 600)), (0, 0), 1.5) * 12
    light = np.linspace(1.1, 0.6, 600)
    return np.clip((np.array(colour) + rough[..., None]) * light[:, None], 0, 255).astype(np.uint8)


@pytest.mark.parametrize("background", [CONCRETE, WOOD], ids=["concrete", "wood"])
@pytest.mark.parametrize("name", COLOURS)
def test_markers_of_any_colour_are_found_and_nothing_else(
    background: tuple[int, int, int], name: str
) -> None:
    rgb, truth = surface(background), np.zeros((400, 600), dtype=bool)
    for x in (60, 300, 520):
        truth[150:190, x : x + 40] = True
    light = np.linspace(1.1, 0.6, 600)[None, :, None]
    rgb[truth] = np.clip(np.array(COLOURS[name]) * light, 0, 255).astype(np.uint8).repeat(400, 0)[truth]
    found = remove(ArrayRaster(rgb), None, PatternSettings(margin_px=3))
    assert found.masked.whole()[truth].mean() > 0.98
    allowed = cv2.dilate(truth.astype(np.uint8), np.ones((11, 11), np.uint8)) > 0
    assert not found.masked.whole()[~allowed].any()
    assert found.pattern_px == found.masked.count()


@pytest.mark.parametrize("background", [CONCRETE, WOOD], ids=["concrete", "wood"])
def test_a_surface_without_markers_stays_whole(background: tuple[int, int, int]) -> None:
    found = remove(ArrayRaster(surface(background)), None, PatternSettings())
    assert found.pattern_px == 0 and not found.masked.count()


def test_a_rust_run_is_not_hidden() -> None:
    rgb = surface(CONCRETE)
    run = np.rint(np.cumsum(np.random.default_rng(3).normal(0, 1.2, 330))).astype(int)
    for y in range(20, 350):
        half = 3 + int(4 * abs(np.sin(y / 35)))
        rgb[y, 300 + run[y - 20] - half : 300 + run[y - 20] + half] = (165, 95, 45)
    assert remove(ArrayRaster(rgb), None, PatternSettings()).pattern_px == 0


def test_a_wall_painted_in_two_colours_stays_whole() -> None:
    rgb = surface((190, 180, 165))
    rgb[: 2 * len(rgb) // 5] = surface((60, 110, 170))[: 2 * len(rgb) // 5]
    assert not remove(ArrayRaster(rgb), None, PatternSettings()).masked.count()


def test_what_no_photo_covers_and_what_is_off_the_surface_is_counted_apart() -> None:
    known = np.ones((400, 600), dtype=bool)
    known[:, :100] = False
    outline = np.array([[50.0, 100.0], [549.0, 100.0], [549.0, 299.0], [50.0, 299.0]])
    hole = np.array([[300.0, 150.0], [349.0, 150.0], [349.0, 199.0], [300.0, 199.0]])
    raster = ArrayRaster(surface(CONCRETE), known)
    found = remove(raster, [outline, hole], PatternSettings())
    assert found.blank_px == 400 * 100
    assert found.outside_px == 400 * 500 - (450 * 200 - 48 * 48)  # a hole's own rim is surface
    assert found.masked.at(np.array([175, 175, 350]), np.array([320, 200, 200])).tolist() == [
        True,
        False,
        True,
    ]


def test_markers_are_left_in_where_asked() -> None:
    rgb = surface(CONCRETE)
    rgb[100:150, 100:150] = COLOURS["pink"]
    assert remove(ArrayRaster(rgb), None, PatternSettings(remove=False)).pattern_px == 0


@pytest.mark.parametrize("shape", [(1, 1), (1, 50), (3, 3)])
def test_tiny_images(shape: tuple[int, int]) -> None:
    found = remove(ArrayRaster(np.full((*shape, 3), 128, dtype=np.uint8)), None, PatternSettings())
    assert found.pattern_px == 0 and found.peaks.i_surface is not None


def test_real_walls_are_hardly_hidden() -> None:
    """Concrete from drones holds no markers: less than 1 % may be taken for them."""
    folder = development_data("cracks/uav/images")
    hidden, pixels = 0, 0
    for path in sorted(folder.glob("*.png"))[::12]:
        rgb = np.ascontiguousarray(cv2.imread(str(path))[..., ::-1])
        hidden += remove(ArrayRaster(rgb), None, PatternSettings()).pattern_px
        pixels += rgb.shape[0] * rgb.shape[1]
    assert hidden < 0.01 * pixels
