"""A scan in another unit than the others: it ties to none of them, and its size tells."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

Points = npt.NDArray[np.floating[Any]]

FACTORS = (1 / 0.3048, 10.0, 100.0, 1000.0)  # between ft, m, cm and mm
ALIKE = 1.3  # scans of one structure differ in size by less, mostly


def other_unit(name: str, samples_m: Mapping[str, Points]) -> str:
    """A sentence where this scan is larger or smaller than the others by about such a factor; else nothing.

    samples_m: (N, 3) of each scan, by its name."""
    sizes_m = {of: _size_m(sample_m) for of, sample_m in samples_m.items()}
    own_m = sizes_m.pop(name)
    if not sizes_m:
        return ""
    usual_m = float(np.median(list(sizes_m.values())))
    ratio = max(own_m, usual_m) / max(min(own_m, usual_m), 1e-9)
    if all(abs(np.log(ratio / factor)) > np.log(ALIKE) for factor in FACTORS):
        return ""
    others = "the other" if len(sizes_m) == 1 else "the others"
    return f" {name} is {own_m:.3g} m large, {others} {usual_m:.3g} m: is its unit stated right?"


def _size_m(sample_m: Points) -> float:
    low_m, high_m = np.percentile(sample_m, [1, 99], axis=0)
    return float(np.linalg.norm(high_m - low_m))
