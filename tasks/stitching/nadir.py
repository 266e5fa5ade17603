"""Whether positions bear out that photos look straight down, where nobody said where they look."""

from collections.abc import Mapping, Sequence

import numpy as np

from tasks.stitching.prior import Prior
from tasks.stitching.view import View

UNSURE_SCALE = 1 / 3  # relative 1σ: positions that tell the scale no better bear nothing out
SQUEEZED = 1 / 3  # mirrored part over the similar one; the layout lies on the map twice as long as wide
SIGMAS = 3.0


def borne_out(priors: Sequence[Prior], solved: Mapping[int, View], sigma_scale: float) -> bool:
    """Photos that look down lie on their mosaic as their positions lie on a map. Before a wall the positions
    lie on a line instead, and below a deck mirrored.

    With positions p and places on the mosaic z, both complex, p = α z + β z̄ + t tells a similarity (β = 0)
    from a line (|β| = |α|) and a mirror image (α = 0); the scatter about it tells how surely. Photos in one
    row tell nothing: along it their scale is right either way."""
    known = [i for i in solved if priors[i].has_position]
    if len(known) < 4 or sigma_scale > UNSURE_SCALE:
        return sigma_scale <= UNSURE_SCALE
    p = np.array([priors[i].view.C[:2] for i in known]) @ [1, 1j]
    z = np.array([solved[i].C[:2] for i in known]) @ [1, 1j]
    M = np.column_stack([z - z.mean(), np.conj(z - z.mean()), np.ones(len(z))])
    fit, _, rank, _ = np.linalg.lstsq(M, p, rcond=None)
    if rank < 3:
        return True
    similar, mirrored = np.abs(fit[:2])
    scatter = np.sum(np.abs(p - M @ fit) ** 2) / (len(z) - 3)
    sigma = np.sqrt(scatter * np.linalg.inv(M.conj().T @ M)[1, 1].real)
    return bool(mirrored < SQUEEZED * similar or mirrored < SIGMAS * sigma)
