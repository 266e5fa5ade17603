import cv2
import numpy as np

from tasks.detection.line_like import compact_objects


def test_keeps_lines_and_large_shade_and_gives_up_blobs() -> None:
    dark = np.zeros((400, 500), np.uint8)
    cv2.circle(dark, (60, 60), 12, 1, cv2.FILLED)
    blob = dark.copy() > 0
    cv2.line(dark, (150, 40), (450, 80), 1, 3)
    cv2.rectangle(dark, (100, 150), (499, 399), 1, cv2.FILLED)
    assert (compact_objects(dark > 0, 63) == blob).all()
