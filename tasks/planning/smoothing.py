"""A path over voxels made straight where the straight way is as safe."""

import numpy as np
import numpy.typing as npt

from tasks.planning.airspace import Airspace

Array = npt.NDArray[np.float64]
STEPS = np.unique(np.rint(1.5 ** np.arange(36))).astype(np.int64)  # 1, 2, 3, 5, 8, … to beyond any path


def shortcut(path_m: Array, airspace: Airspace) -> Array:
    """(Q, 3) of (P, 3): from each kept point on to a far one that a free straight segment reaches.

    Looked for at distances that grow by half, so that long paths cost little. Every point of every kept
    segment keeps the inflation, checked against the scanned points themselves.
    """
    kept = [0]
    while kept[-1] < len(path_m) - 1:
        here = kept[-1]
        steps = np.unique(np.minimum(STEPS, len(path_m) - 1 - here))
        ahead = path_m[here + steps]
        free = airspace.segments_free(np.broadcast_to(path_m[here], ahead.shape), ahead)
        free[0] = True  # the step of the given path itself
        kept.append(here + int(steps[np.flatnonzero(free)[-1]]))
    return np.asarray(path_m[kept])
