"""Decode a photo of any common kind into 8-bit upright RGB, or say by name why it cannot be."""

import struct
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import cast

import cv2
import imagecodecs
import numpy as np
import numpy.typing as npt
import tifffile
from PIL import Image, ImageFile, ImageOps, UnidentifiedImageError

from schemas.problem import BadInput

Pixels = npt.NDArray[np.uint8]

FORMATS = ("JPEG", "PNG", "BMP", "TIFF", "HEIF")
SMALLEST_PX = 32  # per side; less is an icon, not a photo
LARGEST_PX = 32_000  # per side; OpenCV's remap fails from 32,767
LARGEST_PHOTO_PX = 200_000_000  # cameras have up to 150 MP
REMEDY = "Give a JPEG, PNG, BMP, TIFF or HEIC photo, or take this file out of the folder"
HEIC_BRANDS = (b"heic", b"heix", b"hevc", b"heim", b"heis", b"mif1", b"msf1")  # ISO 23008-12, at byte 8

Image.MAX_IMAGE_PIXELS = 600_000_000  # Pillow's own limit refuses cameras of more than 179 MP


# What Pillow raises over damaged bytes, as it happens to trip; warnings where these are made errors.
_DAMAGE = (OSError, ValueError, SyntaxError, struct.error, LookupError, TypeError, ArithmeticError, Warning)


@dataclass(frozen=True)
class Decoded:
    pixels: Pixels  # (H, W, 3) RGB, upright
    orientation: int  # EXIF orientation that has been undone
    as_it_came: bool  # a plain reader gets these very pixels from the file itself
    exif: Image.Exif
    xmp: bytes


def read_photo(path: Path, name: str) -> Decoded:
    """Raises BadInput: not an image, truncated, too small, too large, or of no photographic kind."""
    with _opened(path, name) as image:
        _check_size(image, name)
        has_deep_colour = _has_deep_colour(image)
        exif = image.getexif()
        xmp = image.info.get("xmp", b"")
        orientation = _orientation(exif)
        image.load()  # Pillow turns a TIFF upright itself
        if has_deep_colour:
            stored = Image.fromarray(_deep_colour(path, image.format))
            stored.getexif()[0x0112] = orientation
        else:
            stored = image
        pixels = _rgb(_upright(stored, orientation), name)
        # MPO: a JPEG with a second picture inside, as DJI writes
        known = image.format in ("JPEG", "MPO", "PNG") and image.mode in ("RGB", "L")
        plain = known and orientation == 1 and not has_deep_colour
    return Decoded(pixels, orientation, plain, exif, xmp if isinstance(xmp, bytes) else xmp.encode())


def read_exif(path: Path, name: str) -> Image.Exif:
    """Without decoding the pixels. Raises BadInput: not an image, or damaged."""
    with _opened(path, name) as image:
        return image.getexif()


@contextmanager
def _opened(path: Path, name: str) -> Iterator[Image.Image]:
    """What Pillow raises, here or while the image is used, becomes BadInput."""
    if path.stat().st_size == 0:
        raise BadInput(name, "the file is empty (0 bytes)", REMEDY)
    formats = FORMATS if _is_heic(path) and _heic_is_readable(name) else FORMATS[:-1]
    try:
        with Image.open(path, formats=formats) as image:
            yield image
    except BadInput:
        raise
    except UnidentifiedImageError:
        raise BadInput(name, "is not an image that can be read", REMEDY) from None
    except Image.DecompressionBombError:
        raise BadInput(name, "has more pixels than a photo can have", REMEDY) from None
    except _DAMAGE as error:
        raise BadInput(name, f"is damaged ({error})", "Copy it again from the camera's card") from None


def _is_heic(path: Path) -> bool:
    with path.open("rb") as file:
        head = file.read(12)
    return head[4:8] == b"ftyp" and head[8:] in HEIC_BRANDS


def _heic_is_readable(name: str) -> bool:
    """Raises BadInput where the optional package is absent."""
    try:
        import pillow_heif
    except ImportError:
        raise BadInput(
            name,
            "is a HEIC photo, and the package that reads these is not installed",
            "Type: pip install pillow-heif; or let the camera write JPEG",
        ) from None
    pillow_heif.register_heif_opener()
    return True


def _check_size(image: Image.Image, name: str) -> None:
    width, height = image.size
    if min(width, height) < SMALLEST_PX or max(width, height) > LARGEST_PX:
        raise BadInput(
            name,
            f"is {width} × {height} px; a photo has {SMALLEST_PX} to {LARGEST_PX} px a side",
            REMEDY,
        )


def _orientation(exif: Image.Exif) -> int:
    value = exif.get(0x0112, 1)
    return value if value in range(1, 9) else 1


def _has_deep_colour(image: Image.Image) -> bool:
    """Of an image that is not yet loaded: 16-bit channels, of which Pillow keeps the upper bytes."""
    in_tiff = 16 in getattr(image, "tag_v2", {}).get(258, ())  # BitsPerSample
    packed = image.tile if isinstance(image, ImageFile.ImageFile) else []
    return image.mode in ("RGB", "RGBA") and (in_tiff or any(";16" in str(tile[3]) for tile in packed))


def _deep_colour(path: Path, kind: str | None) -> Pixels:
    """(H, W, 3) as stored, brought to 8 bits. kind: as Pillow names it."""
    try:
        if kind == "PNG":
            values = imagecodecs.png_decode(path.read_bytes())
        else:
            with tifffile.TiffFile(path) as file:
                page = cast(tifffile.TiffPage, file.pages[0])
                apart = page.planarconfig == tifffile.PLANARCONFIG.SEPARATE
                values = np.moveaxis(page.asarray(), 0, -1) if apart else page.asarray()
    except Exception as error:  # whatever a codec raises over damaged bytes
        raise ValueError(error) from error
    colour = np.ascontiguousarray(values[..., :3])  # no alpha: a photo shows what it covers
    return np.asarray(cv2.convertScaleAbs(colour, alpha=255.0 / _white(int(colour.max()))), np.uint8)


def _white(brightest: int) -> float:
    """Cameras of 10, 12 and 14 bits write these into 16, and no file says so: the fewest that hold it."""
    return float(next(2**bits - 1 for bits in (8, 10, 12, 14, 16) if brightest < 2**bits))


def _upright(image: Image.Image, orientation: int) -> Image.Image:
    return image if orientation == 1 else ImageOps.exif_transpose(image)


def _rgb(image: Image.Image, name: str) -> Pixels:
    """Deep grey is scaled to 8 bits, CMYK and palette converted, alpha dropped (a photo shows what it
    covers)."""
    if image.mode.startswith("I") or image.mode == "F":
        values = np.asarray(image, dtype=np.float64)
        if not np.isfinite(values).all() or values.min() < 0 or values.max() > 65535:
            raise BadInput(name, "has floating-point or 32-bit values that are no photo", REMEDY)
        white = 1.0 if image.mode == "F" and values.max() <= 1 else _white(int(values.max()))
        grey = np.rint(values * (255.0 / white)).astype(np.uint8)
        return np.repeat(grey[..., None], 3, axis=2)
    return np.asarray(image if image.mode == "RGB" else image.convert("RGB"))  # convert would copy
