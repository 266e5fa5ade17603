"""Soft stains beside sharp cracks, and components so large that they are looked at tile by tile."""

import cv2
import numpy as np
import pytest

from schemas.bit_mask import BitMask
from schemas.raster import ArrayRaster
from tasks.connected import Marked
from tasks.detection import edges
from tasks.detection.edges import without_soft


def scene() -> tuple[ArrayRaster, np.ndarray, np.ndarray]:
    """A wall with a sharp line and a soft one, and the masks of both."""
    sharp, soft = (np.zeros((500, 900), np.uint8) for _ in range(2))
    cv2.line(sharp, (30, 60), (860, 150), 1, 5)
    cv2.line(soft, (30, 300), (860, 400), 1, 5)
    shade = cv2.GaussianBlur(soft.astype(np.float32), (0, 0), 9.0)
    grey = 170 - 90 * cv2.GaussianBlur(sharp.astype(np.float32), (0, 0), 0.8) - 300 * shade
    grey += np.random.default_rng(2).normal(0, 2, grey.shape)
    rgb = np.clip(grey, 1, 255).astype(np.uint8)[..., None].repeat(3, axis=2)
    return ArrayRaster(rgb), sharp > 0, soft > 0


@pytest.mark.parametrize("tile_px", [edges.TILE_PX, 64])
def test_what_brightens_slowly_is_a_stain(tile_px: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(edges, "TILE_PX", tile_px)
    raster, sharp, soft = scene()
    both = Marked.of(BitMask.of(sharp | soft))
    kept, stains = without_soft(both, raster, both.mask)
    assert (kept.mask.whole() == sharp).all()
    (stain,) = stains
    assert stain == pytest.approx((445, 350), abs=4)


@pytest.mark.parametrize(("half_width_px", "is_stain"), [(20.0, False), (60.0, True)])
def test_beside_what_is_wide_one_looks_further(half_width_px: float, is_stain: bool) -> None:
    """Of a gap 40 px wide, a little out of focus, and of a stain the darkest 30 px are marked."""
    away = np.abs(np.arange(300) - 150.0)
    edge = np.clip((away - half_width_px + 6) / 12, 0, 1)
    shade = 1 - edge if not is_stain else np.exp(-((away / half_width_px) ** 2) / 2)
    grey = np.rint(170 - 120 * shade).astype(np.uint8)
    raster = ArrayRaster(np.tile(grey[:, None, None], (1, 400, 3)))
    middle = np.zeros((300, 400), np.uint8)
    middle[135:166, 100:300] = 1
    marked = Marked.of(BitMask.of(middle > 0))
    kept, stains = without_soft(marked, raster, marked.mask)
    assert len(stains) == is_stain and kept.mask.whole().any() != is_stain


def test_tiles_see_each_pixel_around_a_component_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Whatever the tiles, the same rings."""
    raster, sharp, _ = scene()
    pixels = Marked.of(BitMask.of(sharp))
    of_tiles = []
    for tile_px in (edges.TILE_PX, 64):
        monkeypatch.setattr(edges, "TILE_PX", tile_px)
        rings = []
        for inside, surface, grey, own in edges._tiles(pixels.y, pixels.x, raster, pixels.mask, 17):
            away = cv2.distanceTransform((~inside).astype(np.uint8), cv2.DIST_L2, 5)
            rings.append(grey[surface & own & (away <= edges.FURTHER_PX[1])])
        of_tiles.append(np.sort(np.concatenate(rings)))
    assert (of_tiles[0] == of_tiles[1]).all() and len(of_tiles[0]) > 10_000
