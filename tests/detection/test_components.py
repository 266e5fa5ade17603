import cv2
import numpy as np
import pytest

from tasks.connected import Marked
from tasks.detection.components import components


def test_width_is_that_across_whichever_way_a_component_runs() -> None:
    mask = np.zeros((300, 300), np.uint8)
    mask[20:30, 20:200] = 1
    mask[60:260, 250:257] = 1
    cv2.line(mask, (30, 80), (180, 230), 1, 5)
    wide_px = components(Marked.of_levels(mask)).width_px[1:]
    assert wide_px == pytest.approx([10, 7, 8.5], abs=0.5)  # of a diagonal 1.4 times what it is across
