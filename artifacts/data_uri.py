"""Pictures inside a page: data URIs, of a size that is known beforehand."""

import base64
import io

import cv2
import numpy as np
import numpy.typing as npt
from PIL import Image

Pixels = npt.NDArray[np.uint8]
QUALITIES = (88, 80, 72, 62)
SMALLER = 0.8
LEAST_PX = 96


def png_uri(png: bytes) -> str:
    return "data:image/png;base64," + base64.b64encode(png).decode("ascii")


def mask_uri(mask: npt.NDArray[np.bool_], colour: npt.ArrayLike, opacity: float) -> str:
    """A transparent PNG, `colour` (R, G, B) where `mask` is set."""
    picture = Image.fromarray(mask.astype(np.uint8))
    picture.putpalette([0, 0, 0, *(int(c) for c in np.asarray(colour, dtype=np.uint8))])
    stream = io.BytesIO()
    picture.save(stream, "PNG", bits=1, transparency=bytes([0, round(255 * opacity)]))
    return png_uri(stream.getvalue())


def jpeg_uri(rgb: Pixels, max_bytes: int) -> str:
    """A JPEG of (H, W, 3) or (H, W) pixels of at most `max_bytes` (of the file, base64 adds a third): with
    less quality, then fewer pixels, down to 96 px, where it stays as it is."""
    return "data:image/jpeg;base64," + base64.b64encode(jpeg(rgb, max_bytes)).decode("ascii")


def jpeg(rgb: Pixels, max_bytes: int) -> bytes:
    pixels = np.ascontiguousarray(rgb[..., ::-1]) if rgb.ndim == 3 else rgb
    while True:
        for quality in QUALITIES:
            content = _encoded(pixels, quality)
            if len(content) <= max_bytes:
                return content
        height_px, width_px = pixels.shape[:2]
        if max(height_px, width_px) * SMALLER < LEAST_PX:
            return content
        size = (max(1, round(width_px * SMALLER)), max(1, round(height_px * SMALLER)))
        pixels = np.asarray(cv2.resize(pixels, size, interpolation=cv2.INTER_AREA), dtype=np.uint8)


def _encoded(pixels: Pixels, quality: int) -> bytes:
    flags = [cv2.IMWRITE_JPEG_QUALITY, quality, cv2.IMWRITE_JPEG_OPTIMIZE, 1]
    ok, content = cv2.imencode(".jpg", pixels, flags)
    if not ok:
        raise ValueError(f"a picture of shape {pixels.shape} cannot be encoded")
    return bytes(content)
