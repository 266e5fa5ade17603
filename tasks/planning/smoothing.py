"""A path over voxels made straight where the straight way is as safe."""

import numpy as np
import numpy.typing as npt

from tasks.planning.airspace import Airspace

Array = npt.NDArray[np.float64]


def shortcut(path_m: Array, airspace: Airspace) -> Array:
    """(Q, 3) of (P, 3): from each kept point on to the farthest one that a free straight segment reaches.

    Every point of every kept segment keeps the inflation, checked against the scanned points themselves.
    """
    kept = [0]
    while kept[-1] < len(path_m) - 1:
        here = kept[-1]
        ahead = path_m[here + 1 :]
        free = airspace.segments_free(np.broadcast_to(path_m[here], ahead.shape), ahead)
        free[0] = True  # the step of the given path itself
        kept.append(here + 1 + int(np.flatnonzero(free)[-1]))
    return np.asarray(path_m[kept])
