"""How sharp and how bright a photo is."""

import cv2
import numpy as np

from schemas.contract import Vector4
from tasks.photos.reading import Pixels

SHRINK = 4  # measured on a copy so much smaller: a blurred photo keeps its sensor noise, this takes it out
AROUND_PX = 8.0  # of the copy: contrast on larger scales is light and shade, and says nothing of sharpness

BENDS = tuple(
    np.array(kernel, np.float32)
    for kernel in (
        ((0, 0, 0), (1, -2, 1), (0, 0, 0)),
        ((0, 1, 0), (0, -2, 0), (0, 1, 0)),
        ((0, 0, 1), (0, -2, 0), (1, 0, 0)),
        ((1, 0, 0), (0, -2, 0), (0, 0, 1)),
    )
)  # second differences along 0, 90, 45 and 135°
WHITE, BLACK = 253, 2  # JPEG moves clipped values by one or two


def sharpness(pixels: Pixels) -> tuple[float, Vector4]:
    """Variance of the Laplacian over the variance of local contrast, on a copy of a quarter of the size; and
    that of second derivatives along 0, 90, 45 and 135°.

    Nearly the same for photos of one camera whatever they show; 3 px of blur divide it by ten, 15 px of
    motion the one along it by five to ten. 0 for an image of one grey."""
    grey = cv2.cvtColor(pixels, cv2.COLOR_RGB2GRAY)
    size = (max(grey.shape[1] // SHRINK, 1), max(grey.shape[0] // SHRINK, 1))
    small = cv2.resize(grey, size, interpolation=cv2.INTER_AREA).astype(np.float32)
    contrast = float((small - cv2.GaussianBlur(small, (0, 0), AROUND_PX)).var())
    if contrast <= 0:
        return 0.0, (0.0, 0.0, 0.0, 0.0)
    a, b, c, d = (float(cv2.filter2D(small, -1, bend).var()) / contrast for bend in BENDS)
    return float(cv2.Laplacian(small, cv2.CV_32F).var()) / contrast, (a, b, c, d)


def exposure(pixels: Pixels) -> float:
    """Mean grey, 0..1."""
    return float(np.mean(cv2.mean(pixels)[:3])) / 255.0


def clipped(pixels: Pixels) -> tuple[float, float]:
    """Shares of pixels that are white and that are black in every channel."""
    count = pixels.shape[0] * pixels.shape[1]
    white = cv2.inRange(pixels, np.full(3, WHITE, np.uint8), np.full(3, 255, np.uint8))
    black = cv2.inRange(pixels, np.zeros(3, np.uint8), np.full(3, BLACK, np.uint8))
    return cv2.countNonZero(white) / count, cv2.countNonZero(black) / count
