"""The paper's step before Sauvola: "retain only the background and line-like objects".

It prints no more than that it uses the automatic peak detection. Our reading: pixels darker than midway
between the surface's peak and the next darker one are objects; an object that is compact (no line) and
smaller than Sauvola's window is taken out by giving it the surface's own level. Larger dark regions are
background in the shade, and stay.
"""

import numpy as np

from tasks.connected import Marked
from tasks.detection.components import components
from tasks.detection.sauvola import Mask

LINE_ELONGATION = 3.0  # extent over mean width: a disc has 2.5


def compact_objects(dark: Mask, window_px: int) -> Mask:
    """(H, W): the dark pixels that belong to compact objects smaller than the window."""
    found = components(Marked.of_levels(dark.view(np.uint8)))
    compact = found.elongation < LINE_ELONGATION
    return np.asarray(found.keep(compact & (found.extent_px < window_px)).mask.whole())
