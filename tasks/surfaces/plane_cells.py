"""Square cells on a plane: which points lie among or beside others."""

import numpy as np

from tasks.surfaces.cloud import Floats, Indices, Mask

ROW = 2**31  # cells in a row of the plane


def beside(uvw_m: Floats, others_uvw_m: Floats, cell_m: float, around: int = 0) -> Mask:
    """(N,) which points have some of the others in their in-plane cell, or within `around` cells of it."""
    steps = range(-around, around + 1)
    others = np.unique(_cells(others_uvw_m, cell_m))
    occupied = np.unique(np.concatenate([others + ROW * i + j for i in steps for j in steps]))
    return np.asarray(np.isin(_cells(uvw_m, cell_m), occupied))


def _cells(uvw_m: Floats, cell_m: float) -> Indices:
    column, row = np.floor(uvw_m[:, :2] / cell_m).astype(np.int64).T
    return np.asarray(row * ROW + column)
