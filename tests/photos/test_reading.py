"""Every kind of file that a folder of photos may hold: read right, or refused by name."""

import sys
from pathlib import Path

import cv2
import numpy as np
import pytest
import tifffile
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image

from artifacts import store
from schemas.problem import BadInput
from tasks.photos.metadata import read_metadata
from tasks.photos.reading import read_photo
from tasks.photos.task import ingest


def gradient(width: int = 96, height: int = 64) -> np.ndarray:
    """(H, W, 3): red grows to the right, green downwards."""
    rgb = np.full((height, width, 3), 90, np.uint8)
    rgb[..., 0] = np.linspace(0, 250, width).astype(np.uint8)
    rgb[..., 1] = np.linspace(0, 250, height).astype(np.uint8)[:, None]
    return rgb


@pytest.mark.parametrize("suffix", ["jpg", "png", "bmp", "tif"])
def test_common_formats_give_the_same_pixels(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"photo.{suffix}"
    Image.fromarray(gradient()).save(path, quality=98)
    decoded = read_photo(path, path.name)
    assert np.abs(decoded.pixels.astype(int) - gradient()).max() <= (6 if suffix == "jpg" else 0)
    assert decoded.as_it_came == (suffix in ("jpg", "png"))


@pytest.mark.parametrize("orientation", range(1, 9))
def test_orientation_is_undone(tmp_path: Path, orientation: int) -> None:
    upright = Image.fromarray(gradient())
    undo = {
        2: Image.Transpose.FLIP_LEFT_RIGHT,
        3: Image.Transpose.ROTATE_180,
        4: Image.Transpose.FLIP_TOP_BOTTOM,
        5: Image.Transpose.TRANSPOSE,
        6: Image.Transpose.ROTATE_90,
        7: Image.Transpose.TRANSVERSE,
        8: Image.Transpose.ROTATE_270,
    }
    stored = upright.transpose(undo[orientation]) if orientation > 1 else upright
    exif = Image.Exif()
    exif[0x0112] = orientation
    stored.save(tmp_path / "turned.png", exif=exif)
    decoded = read_photo(tmp_path / "turned.png", "turned.png")
    np.testing.assert_array_equal(decoded.pixels, gradient())
    assert decoded.orientation == orientation
    assert decoded.as_it_came == (orientation == 1)


def test_odd_pixel_formats_are_read_right(tmp_path: Path) -> None:
    rgb = gradient()
    grey = rgb[..., 0]
    alpha = np.dstack([rgb, np.full(grey.shape, 17, np.uint8)])
    Image.fromarray(grey).save(tmp_path / "grey.png")
    Image.fromarray(alpha).save(tmp_path / "alpha.png")
    Image.fromarray(grey.astype(np.uint16) * 257).save(tmp_path / "deep.png")
    Image.fromarray(grey.astype(np.uint16) * 257).save(tmp_path / "deep.tif")
    Image.fromarray(grey.astype(np.float32) / 255).save(tmp_path / "float.tif")
    for name in ("palette.png", "palette.bmp"):
        Image.fromarray(rgb).quantize(256).save(tmp_path / name)
    expected = np.repeat(grey[..., None], 3, axis=2)
    for name in ("grey.png", "deep.png", "deep.tif"):
        np.testing.assert_array_equal(read_photo(tmp_path / name, name).pixels, expected)
    assert np.abs(read_photo(tmp_path / "float.tif", "f").pixels.astype(int) - expected).max() <= 4
    np.testing.assert_array_equal(read_photo(tmp_path / "alpha.png", "a").pixels, rgb)
    for name in ("palette.png", "palette.bmp"):
        assert np.abs(read_photo(tmp_path / name, name).pixels.astype(int) - rgb).mean() < 6


def test_cmyk_is_converted(tmp_path: Path) -> None:
    Image.fromarray(gradient()).convert("CMYK").save(tmp_path / "print.jpg", quality=98)
    decoded = read_photo(tmp_path / "print.jpg", "print.jpg")
    assert np.abs(decoded.pixels.astype(int) - gradient()).mean() < 4
    assert not decoded.as_it_came


def test_heic_is_read_as_it_is_shown(tmp_path: Path) -> None:
    pillow_heif = pytest.importorskip("pillow_heif", reason="the optional extra heic is not installed")
    pillow_heif.register_heif_opener()
    exif = Image.Exif()
    exif[0x0112] = 6  # not counted in HEIC (ISO 23008-12): its own boxes turn it, in libheif
    exif.get_ifd(0x8769)[0x920A] = 4.25
    Image.fromarray(gradient()).save(tmp_path / "phone.heic", quality=95, exif=exif)
    decoded = read_photo(tmp_path / "phone.heic", "phone.heic")
    assert np.abs(decoded.pixels.astype(int) - gradient()).mean() < 6
    assert not decoded.as_it_came
    assert read_metadata(decoded.exif, decoded.xmp).focal_mm == 4.25


def test_heic_without_its_package_says_what_to_install(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "pillow_heif", None)
    (tmp_path / "phone.jpg").write_bytes(b"\x00\x00\x00\x24ftypheic" + bytes(200))  # the suffix is no matter
    with pytest.raises(BadInput, match="HEIC") as caught:
        read_photo(tmp_path / "phone.jpg", "phone.jpg")
    assert "pip install pillow-heif" in caught.value.remedy


def test_the_suffix_is_no_matter_and_neither_is_progressive_storage(tmp_path: Path) -> None:
    rgb = gradient()
    Image.fromarray(rgb).save(tmp_path / "really-a-png.jpg", format="PNG")
    Image.fromarray(rgb).save(tmp_path / "progressive.jpg", quality=98, progressive=True)
    np.testing.assert_array_equal(read_photo(tmp_path / "really-a-png.jpg", "p").pixels, rgb)
    assert np.abs(read_photo(tmp_path / "progressive.jpg", "q").pixels.astype(int) - rgb).max() <= 6


def test_sixteen_bit_colour_keeps_its_brightness(tmp_path: Path) -> None:
    rgb = gradient()
    deep = rgb.astype(np.uint16) * 257
    tifffile.imwrite(tmp_path / "deep.tif", deep, photometric="rgb")
    cv2.imwrite(str(tmp_path / "deep.png"), deep[..., ::-1])
    for name in ("deep.tif", "deep.png"):
        decoded = read_photo(tmp_path / name, name)
        assert np.abs(decoded.pixels.astype(int) - rgb).max() <= 1, name


@pytest.mark.parametrize("bits", [10, 12, 14, 16])
def test_deep_photos_are_scaled_by_the_bits_that_are_used(tmp_path: Path, bits: int) -> None:
    white = 2**bits - 1
    rgb = gradient().astype(np.uint16)
    deep = (rgb * (white / 255)).round().astype(np.uint16)
    deep[0, 0] = white
    alpha = np.full(rgb.shape[:2], 65535, np.uint16)
    tifffile.imwrite(tmp_path / "rgb.tif", deep, photometric="rgb")
    apart = np.moveaxis(deep, -1, 0)
    tifffile.imwrite(tmp_path / "apart.tif", apart, photometric="rgb", planarconfig="separate")
    cv2.imwrite(str(tmp_path / "rgb.png"), deep[..., ::-1])
    cv2.imwrite(str(tmp_path / "rgba.png"), np.dstack([deep[..., ::-1], alpha]))
    cv2.imwrite(str(tmp_path / "grey.png"), deep[..., 0])
    cv2.imwrite(str(tmp_path / "grey.tif"), deep[..., 0])
    for path in sorted(tmp_path.iterdir()):
        decoded = read_photo(path, path.name)
        expected = rgb if path.stem != "grey" else np.repeat(rgb[..., :1], 3, axis=2)
        assert np.abs(decoded.pixels.astype(int) - expected)[1:].max() <= 1, path.name
        assert not decoded.as_it_came, path.name


@pytest.mark.parametrize("orientation", range(1, 9))
@pytest.mark.parametrize("kind", [np.uint8, np.uint16])
def test_a_tiff_is_turned_once(tmp_path: Path, orientation: int, kind: type[np.generic]) -> None:
    rgb = gradient()
    stored = rgb.astype(kind) * (1 if kind is np.uint8 else 257)
    tag = (274, "H", 1, orientation, True)
    tifffile.imwrite(tmp_path / "turned.tif", stored, photometric="rgb", extratags=[tag])
    exif = Image.Exif()
    exif[0x0112] = orientation
    Image.fromarray(rgb).save(tmp_path / "turned.png", exif=exif)
    of_tiff, of_png = (read_photo(tmp_path / f"turned.{suffix}", "t") for suffix in ("tif", "png"))
    np.testing.assert_array_equal(of_tiff.pixels, of_png.pixels)
    assert of_tiff.orientation == of_png.orientation == orientation


@pytest.mark.parametrize(
    "name", ["a photo with spaces.jpg", "Brücke–№1 橋.jpg", "-rf.jpg", "100%{x}[red].jpg", "a'b\"c.jpg"]
)
def test_hostile_names(tmp_path: Path, name: str) -> None:
    Image.fromarray(gradient()).save(tmp_path / name)
    with store.temporary():
        photo = ingest.bare(store.current().put(tmp_path / name), name, "wall", None, None, 5.0)
    assert photo.name == name
    assert photo.camera.width_px == 96


@pytest.mark.parametrize(
    ("name", "content", "what"),
    [
        ("empty.jpg", b"", "empty"),
        ("notes.jpg", b"these are notes, no photo\n" * 40, "not an image"),
        ("zeros.png", b"\x89PNG\r\n\x1a\n" + bytes(200), "zeros.png"),
    ],
)
def test_what_is_no_photo_is_refused_by_name(tmp_path: Path, name: str, content: bytes, what: str) -> None:
    (tmp_path / name).write_bytes(content)
    with pytest.raises(BadInput, match=what) as caught:
        read_photo(tmp_path / name, name)
    assert caught.value.item == name
    assert caught.value.remedy


def test_one_pixel_is_no_photo(tmp_path: Path) -> None:
    Image.fromarray(np.zeros((1, 1, 3), np.uint8)).save(tmp_path / "dot.png")
    with pytest.raises(BadInput, match="1 × 1 px"):
        read_photo(tmp_path / "dot.png", "dot.png")


@pytest.mark.parametrize("suffix", ["jpg", "png", "bmp", "tif"])
@settings(max_examples=25)
@given(share=st.floats(0.02, 0.9), seed=st.integers(0, 10_000))
def test_a_truncated_or_scrambled_file_never_gets_out_as_another_error(
    tmp_path_factory: pytest.TempPathFactory, suffix: str, share: float, seed: int
) -> None:
    path = tmp_path_factory.getbasetemp() / f"hurt.{suffix}"
    noisy = np.random.default_rng(1).integers(0, 255, (64, 96, 3)).astype(np.uint8)
    Image.fromarray(noisy).save(path)
    whole = bytearray(path.read_bytes())
    path.write_bytes(whole[: int(len(whole) * share)])
    with pytest.raises(BadInput) as caught:
        read_photo(path, "hurt")
    assert caught.value.item == "hurt"
    for at in np.random.default_rng(seed).integers(0, len(whole), 20):
        whole[at] ^= 0x5A
    path.write_bytes(whole)
    try:
        read_photo(path, "hurt")
    except BadInput as problem:
        assert problem.item == "hurt"
