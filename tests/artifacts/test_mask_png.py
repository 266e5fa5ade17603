from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image

from artifacts.mask_png import read_mask, write_mask
from schemas.bit_mask import BitMask
from schemas.problem import BadInput


def blotches(height: int, width: int, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).random((height, width)) < 0.2


@given(st.integers(1, 1100), st.integers(1, 70), st.integers(0, 99))
@settings(max_examples=20)
def test_any_image_viewer_sees_what_we_read_back(
    tmp_path_factory: pytest.TempPathFactory, height: int, width: int, seed: int
) -> None:
    path = tmp_path_factory.mktemp("mask") / "m.png"
    mask = blotches(height, width, seed)
    write_mask(BitMask.of(mask), path)
    assert (read_mask(path, "wall").whole() == mask).all()
    assert (np.asarray(cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)) == np.where(mask, 255, 0)).all()
    assert (np.asarray(Image.open(path)) == np.where(mask, 255, 0)).all()


def test_a_mask_with_more_pixels_than_opencv_reads(tmp_path: Path) -> None:
    mask = BitMask(33_000, 33_000)
    y, x = np.array([5, 32_999]), np.array([32_999, 7])
    mask.set(y, x)
    write_mask(mask, tmp_path / "m.png")
    read = read_mask(tmp_path / "m.png", "wall")
    assert (read.height_px, read.width_px, read.count()) == (33_000, 33_000, 2)
    assert read.at(y, x).all()


def test_what_is_cut_short_or_damaged_or_another_png_is_named(tmp_path: Path) -> None:
    path = tmp_path / "m.png"
    write_mask(BitMask.of(blotches(300, 200)), path)
    content = path.read_bytes()
    cv2.imwrite(str(path), np.zeros((30, 40), np.uint8))
    theirs = path.read_bytes()
    cv2.imwrite(str(path), np.zeros((30, 40, 3), np.uint8))
    flipped = content[:900] + bytes([content[900] ^ 1]) + content[901:]
    for wrong in (
        theirs,
        path.read_bytes(),
        content[:-20],
        content[: len(content) // 2],
        flipped,
        b"",
        b"text",
    ):
        path.write_bytes(wrong)
        with pytest.raises(BadInput, match=r"pier: its mask cannot be read"):
            read_mask(path, "pier")
