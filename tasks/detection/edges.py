"""A crack has sharp edges: right beside it the surface is as bright as a little further away. The middle of a
stain, a rust run or a soft shadow is dark as well, but brightens slowly."""

import cv2
import numpy as np

from tasks.detection.components import components
from tasks.detection.sauvola import Grey, Mask

BESIDE_PX = (3.0, 6.0)  # distances from the component's rim that count as right beside it
FURTHER_PX = (10.0, 16.0)  # and as further away
SHARP = 0.6  # least share of the contrast that is reached right beside it
ENOUGH_PX = 10  # pixels that a ring must have to be judged by


def without_soft(mask: Mask, grey: Grey, surface: Mask) -> tuple[Mask, list[tuple[float, float]]]:
    """`mask` less the components whose edges are soft, and where these were (x, y).

    surface: (H, W), False where a pixel is dark or unknown and says nothing about the brightness beside."""
    found = components(mask)
    sharp = np.ones(len(found.area_px), dtype=bool)
    soft_at = []
    margin = int(FURTHER_PX[1]) + 1
    for label in range(1, len(sharp)):
        x, y, width, height = found.box(label)
        rows = slice(max(0, y - margin), y + height + margin)
        columns = slice(max(0, x - margin), x + width + margin)
        inside = found.labels[rows, columns] == label
        if not _is_sharp(inside, surface[rows, columns], grey[rows, columns]):
            sharp[label] = False
            soft_at.append((x + width / 2, y + height / 2))
    return found.keep(sharp), soft_at


def _is_sharp(inside: Mask, surface: Mask, grey: Grey) -> bool:
    away = cv2.distanceTransform((~inside).astype(np.uint8), cv2.DIST_L2, 5)
    beside, further = (grey[surface & (away >= a) & (away <= b)] for a, b in (BESIDE_PX, FURTHER_PX))
    if min(len(beside), len(further)) < ENOUGH_PX:
        return True
    core = float(np.median(grey[inside]))
    return float(beside.mean()) - core >= SHARP * (float(further.mean()) - core)
