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
    assert components(Marked.of_levels(mask)).width_px[1:] == pytest.approx([10, 7, 7], abs=1)
