"""Photos that stand for themselves, and show nothing or what another shows."""

import numpy as np
import pytest
from PIL import Image

from artifacts import store
from schemas.photo import Photo
from schemas.problem import BadInput
from tasks.photos.alone import fit_alone
from tasks.photos.quality import clipped, sharpness
from tasks.photos.reading import read_photo
from tasks.photos.task import ingest
from tests.development_data import development_data


def ingested(pixels: np.ndarray, name: str) -> Photo:
    with store.current().scratch() as folder:
        Image.fromarray(pixels).save(folder / name)
        return ingest.bare(store.current().put(folder / name), name, "wall", None, None, 5.0)


def test_what_shows_nothing_is_not_inspected_and_neither_is_a_copy() -> None:
    wall = np.random.default_rng(0).normal(120, 6, (120, 160, 3)).astype(np.uint8)
    dark = np.where(np.arange(160)[:, None] < 90, 0, wall).astype(np.uint8)
    pictures = {
        "wall.png": wall,
        "black.png": np.zeros_like(wall),
        "white.jpg": np.full_like(wall, 255),
        "grey.jpg": np.full_like(wall, 128),
        "dark.png": dark,
        "copy.png": wall,
        "crop.png": wall[:32, :32],
    }
    with store.temporary():
        found = fit_alone([ingested(pixels, name) for name, pixels in pictures.items()])
    told = {one.item: one.what for one in found if isinstance(one, BadInput)}
    assert told == {
        "black.png": "underexposed (100% of it is black)",
        "white.jpg": "overexposed (100% of it is white)",
        "grey.jpg": "blank (all of it is one grey)",
        "dark.png": "underexposed (56% of it is black)",
        "copy.png": "the same picture as wall.png",
    }


@pytest.mark.parametrize("folder", ["cracks/uav/images", "cracks/deepcrack_train/images"])
def test_ordinary_photos_are_inspected(folder: str) -> None:
    for path in sorted(development_data(folder).iterdir())[::10]:
        pixels = read_photo(path, path.name).pixels
        assert max(clipped(pixels)) < 0.1 and sharpness(pixels)[0] > 0.1, path.name
